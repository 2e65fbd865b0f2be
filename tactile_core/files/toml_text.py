"""Write TOML that people read: a comment beside what needs one, numbers with six digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from .outside import toml_quoted


def as_toml(content: msgspec.Struct, notes: Mapping[str, str], head: Sequence[str] = ()) -> str:
    """Format a struct as TOML: plain fields, then a table for each struct or dict; fields that are None are left out.

    Structs within tables stand in one line, dicts have a table of their own.
    notes : comments, by the name of a table or field, as ``camera`` or ``camera.width_px``
    head : comments above all
    """
    fields = {name: value for name, value in msgspec.structs.asdict(content).items() if value is not None}
    plain = {name: value for name, value in fields.items() if not _is_table(value)}
    lines = [*(f"# {line}" for line in head), *_lines("", plain, notes)]
    for name, table in fields.items():
        if _is_table(table):
            lines += _table(name, table, notes)
    return "\n".join(lines) + "\n"


def _is_table(value: Any) -> bool:
    return isinstance(value, (msgspec.Struct, dict))


def _table(name: str, table: msgspec.Struct | dict, notes: Mapping[str, str]) -> list[str]:
    if isinstance(table, dict):
        quoted = {toml_quoted(key): value for key, value in table.items()}
        return ["", f"[{name}]{_note(notes, name)}", *_lines(name, quoted, notes)]
    fields = {key: value for key, value in msgspec.structs.asdict(table).items() if value is not None}
    plain = {key: value for key, value in fields.items() if not isinstance(value, dict)}
    lines = ["", f"[{name}]{_note(notes, name)}", *_lines(name, plain, notes)]
    for key, inner in fields.items():
        if isinstance(inner, dict):
            lines += _table(f"{name}.{key}", inner, notes)
    return lines


def _lines(table: str, fields: Mapping[str, Any], notes: Mapping[str, str]) -> list[str]:
    prefix = f"{table}." if table else ""
    return [f"{name} = {_value(value)}{_note(notes, prefix + name)}" for name, value in fields.items()]


def _note(notes: Mapping[str, str], name: str) -> str:
    return f"  # {notes[name]}" if name in notes else ""


def _value(value: Any) -> str:
    if isinstance(value, str):
        return toml_quoted(value)
    if isinstance(value, msgspec.Struct):
        held = msgspec.structs.asdict(value).items()
        pairs = ", ".join(f"{name} = {_value(item)}" for name, item in held if item is not None)
        return f"{{ {pairs} }}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(_value, value)) + "]"
    return f"{value + 0.0:.6g}"  # no negative zero
