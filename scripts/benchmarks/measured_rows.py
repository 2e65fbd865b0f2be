"""Print the rows of a measuring script as they come, write them as JSON or CSV, and name those that miss a target."""

from __future__ import annotations

import argparse
import concurrent.futures
import csv
import io
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from tactile_core.accuracy import HEADER, Row, failed, line
from tactile_core.files import atomic, threads

COLUMNS = ("name", "value", "unit", "target", "baseline", "set", "ok")


def parser_of(about: str | None, json: bool = True) -> argparse.ArgumentParser:
    """Make the parser of a script; about : the script's docstring; json : true if the script has ``--json FILE``"""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    if json:
        parser.add_argument("--json", type=Path, metavar="FILE", help="write what was measured here")
    return parser


def printed(rows: Iterable[Row]) -> list[Row]:
    """Print a table's head, then each row as soon as it is measured; return the rows."""
    print(HEADER)
    found = []
    for each in rows:
        found.append(each)
        print(line(each), flush=True)
    return found


def in_processes(work: Callable[[Any], str], jobs: Sequence[Any], count: int) -> None:
    """Call ``work`` with each job, in ``count`` processes of one thread; print the line that each call returns."""
    with threads.one_thread(), concurrent.futures.ProcessPoolExecutor(count) as pool:
        for done, line_of in enumerate(pool.map(work, jobs), 1):
            print(f"{done}/{len(jobs)} {line_of}", flush=True)


def write_table(path: Path, parts: dict[str, list[Row]]) -> None:
    """Write the rows of a page as CSV; parts : heading -> its rows."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["part", *COLUMNS])
    for part, rows in parts.items():
        table.writerows([part, *(each[name] for name in COLUMNS)] for each in rows)
    atomic.write_bytes(path, text.getvalue().encode())


def read_table(path: Path) -> list[dict[str, str]]:
    """Read the rows that ``write_table`` wrote, their cells as text."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def renew_tables(page: Path, tables: dict[str, list[str]]) -> None:
    """Replace tables in a page of Markdown; its other text stays.

    tables : text that the page has once -> new lines of the first table at or after that text
    Raises ValueError if the page lacks a text or a table.
    """
    text = page.read_text(encoding="utf-8")
    for before, lines in tables.items():
        old = re.compile(r"(^\|.*\n)+", re.MULTILINE).search(text, text.index(before))
        if text.count(before) != 1 or old is None:
            raise ValueError(f"{page} has {before!r} {text.count(before)} times, where it wants one table after it")
        text = text[: old.start()] + "\n".join([*lines, ""]) + text[old.end() :]
    atomic.write_bytes(page, text.encode())


def short(value: float | None) -> str:
    """Return a value as text with two digits, from 10 on without decimals; "-" for None."""
    return "-" if value is None else f"{float(f'{value:.2g}'):,.0f}" if value >= 10 else f"{value:.2g}"


def png_of(figure: Any) -> bytes:
    """Return a matplotlib figure as the bytes of a PNG without a date; pyplot's state is not touched."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    content = io.BytesIO()
    FigureCanvasAgg(figure).print_png(content, metadata={"Software": None})
    return content.getvalue()


def finished(rows: list[Row], json: Path | None) -> int:
    """Write rows to the file ``json``, if given, and name those that miss a target; return 1 if any does, else 0."""
    if json:
        atomic.write_json(json, rows)
    for each in failed(rows):
        print(f"MISSED: {each['name']} = {each['value']} {each['unit']}, target {each['target']}", file=sys.stderr)
    return int(bool(failed(rows)))
