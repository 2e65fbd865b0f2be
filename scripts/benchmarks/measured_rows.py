"""Print the rows of a measuring script as they come, write them as JSON, and name those that miss their target."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

from tactile_core.accuracy import HEADER, Row, failed, line
from tactile_core.files import atomic


def parser_of(about: str | None) -> argparse.ArgumentParser:
    """Make the parser of a script that measures; about : the script's docstring."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows here")
    return parser


def printed(rows: Iterable[Row]) -> list[Row]:
    """Print the head of a table and each row as soon as it is measured; returns the rows."""
    print(HEADER)
    found = []
    for each in rows:
        found.append(each)
        print(line(each), flush=True)
    return found


def finished(rows: list[Row], json: Path | None) -> int:
    """Write the rows to a file, if one is given, and name those that miss their target; returns the exit status."""
    if json:
        atomic.write_json(json, rows)
    for each in failed(rows):
        print(f"MISSED: {each['name']} = {each['value']} {each['unit']}, target {each['target']}", file=sys.stderr)
    return int(bool(failed(rows)))
