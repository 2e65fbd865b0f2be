"""Print a verb's output: results on stdout, everything else in single lines on stderr, and progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


def tell(text: str) -> None:
    """A result, on stdout."""
    sys.stdout.write(text + "\n")


def say(text: str) -> None:
    """Print one line on stderr, whatever the text holds."""
    sys.stderr.write("tactile: " + " ".join(text.split()) + "\n")


def complain(text: str) -> None:
    """An error, on stderr."""
    say("error: " + text)


@contextmanager
def bar(name: str, unit: str, forced: bool) -> Iterator[Callable[[int, int], None]]:
    """A callback (done, in all) that draws a bar: on a terminal, for what takes over two seconds; or when forced."""
    if not forced and not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from tqdm import tqdm

    with tqdm(desc=name, unit=unit, delay=0 if forced else 2, file=sys.stderr) as shown:

        def show(done: int, total: int) -> None:
            shown.total = total
            shown.update(done - shown.n)

        yield show
