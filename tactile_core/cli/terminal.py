"""Print a verb's output: results on stdout; all else, with progress, in single lines on stderr."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..errors import TactileError


def tell(text: str) -> None:
    """Print a result on stdout; its line breaks are kept. Raises TactileError if it cannot be written."""
    with _written():
        sys.stdout.write("\n".join(map(printable, text.split("\n"))) + "\n")


def flush() -> None:
    """Flush stdout. Raises TactileError if it cannot be written."""
    with _written():
        sys.stdout.flush()


def discard_output() -> None:
    """Discard what is buffered for stdout, which Python would try to write again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextmanager
def _written() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        discard_output()
        found = f"cannot be written ({error.strerror})"
        raise TactileError("what is printed", found, "a terminal, or a file with room", "Make room") from error


def say(text: str) -> None:
    """Print the text as one line on stderr, after "tactile: ", its line breaks and control characters made harmless."""
    sys.stderr.write("tactile: " + printable(" ".join(text.split())) + "\n")


def printable(text: str) -> str:
    """Return the text with control characters escaped: in a file's name they could move the cursor."""
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in text)


def next_step(text: str) -> None:
    """Print what the user may open or run next, on stderr: stdout holds the result's path alone, for scripts."""
    flush()  # after the path, in a log that takes both
    say("next: " + text)


def counted(number: int, thing: str) -> str:
    """Return a number of things in words: 1 shard, 2 shards, 3 presses; a thing that is no word, such as %, stays."""
    if number == 1 or not thing.isalpha():
        return f"{number} {thing}"
    return f"{number} {thing}{'es' if thing.endswith('s') else 's'}"


def complain(text: str) -> None:
    """Print an error as one line on stderr, after "error: "."""
    say("error: " + text)


LONG = 60.0  # s from which on a job is asked about


def duration(seconds: float) -> str:
    """Return seconds as text in their most readable unit: 40 s, 12 min, 3.5 h."""
    if seconds < 2 * LONG:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def agree(cost: str, seconds: float, agreed: bool) -> None:
    """Print a cost; ask to begin if it takes many `seconds`, unless `agreed`. Raises TactileError without consent."""
    say(cost)
    if agreed or seconds <= LONG:
        return
    if sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty():
        sys.stderr.write("tactile: begin? [y/N] ")
        sys.stderr.flush()
        if sys.stdin.readline().strip().lower() in ("y", "yes"):
            return
    raise TactileError("the cost", cost, f"at most {LONG:g} s, or --yes", "Add --yes, or allow a larger --error")


EVERY = 10.0  # s between two lines of progress in a log


@contextmanager
def bar(name: str, unit: str, forced: bool) -> Iterator[Callable[[int, int], None]]:
    """Yield a callback (done, in all) that shows progress: a bar on a terminal or if `forced`, else a line every 10 s.
    name : word for the work, before the numbers; unit : what is counted, in the singular"""
    if not forced and not sys.stderr.isatty():
        yield _lines(name, unit)
        return
    from tqdm import tqdm

    with tqdm(desc=name, unit=unit, delay=0 if forced else 2, file=sys.stderr) as shown:

        def show(done: int, total: int) -> None:
            shown.total = total
            shown.update(done - shown.n)

        yield show


def _lines(name: str, unit: str) -> Callable[[int, int], None]:
    """Return a callback (done, in all) that prints a line of progress at most every EVERY seconds."""
    last = time.monotonic()

    def show(done: int, total: int) -> None:
        nonlocal last
        if time.monotonic() - last >= EVERY:
            last = time.monotonic()
            say(f"{name}: {done} of {counted(total, unit)}")

    return show
