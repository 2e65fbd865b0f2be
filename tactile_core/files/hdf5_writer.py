"""Write new HDF5 files so that a full disk raises an error instead of a crash."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import h5py


class Disk(io.FileIO):
    """File for HDF5 that hides the disk's errors from the library; `check` raises them. HDF5 cannot close a file whose
    writing failed: it keeps the space on the disk and crashes at exit (seen with HDF5 1.14 and packed datasets). With
    this object it always closes; the file is thrown away."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self._path = path
        self._failure: OSError | None = None

    def check(self) -> None:
        """Raise the first OSError that the disk gave, if any."""
        if self._failure is not None:
            raise OSError(self._failure.errno, self._failure.strerror, str(self._path)) from self._failure

    def write(self, data: Any) -> int:
        """Write all of the data as any file does; an error of the disk is kept for `check`."""
        rest = memoryview(data).cast("B")
        count = len(rest)
        try:
            while len(rest) and self._failure is None:
                rest = rest[super().write(rest) :]  # one call may write a part
        except OSError as error:
            self._failure = error
        return count

    def truncate(self, size: int | None = None) -> int:
        """Truncate as any file does; an error of the disk is kept for `check`."""
        try:
            return super().truncate(size)
        except OSError as error:
            self._failure = self._failure or error
            return self.tell() if size is None else size


@contextmanager
def new_hdf5(path: Path, attributes: Mapping[str, Any], room: int = 0) -> Iterator[tuple[h5py.File, Disk]]:
    """Yield a new HDF5 file, and its `Disk` to check between parts; the end of the block closes it.
    attributes : those of its root; room : bytes before the HDF5 part: 0, 512, 1024 and so on
    Raises what the block raises, or the disk's OSError if HDF5 failed by that."""
    import h5py

    with Disk(path) as disk:
        try:
            file = h5py.File(disk, "w", userblock_size=room)
            try:
                file.attrs.update(attributes)
                yield file, disk
            except BaseException:
                with suppress(Exception):  # the error on its way out says more
                    file.close()
                raise
            file.close()
        except Exception:  # raised again, unless the disk knows better: HDF5 gives many types to one cause
            disk.check()
            raise
        disk.check()
