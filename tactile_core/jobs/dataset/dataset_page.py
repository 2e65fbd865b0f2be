"""The page of a data set: every recording as a strip of pictures, in one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import json
import string
from collections.abc import Callable
from html import escape

import numpy as np

from ...files.png_writer import pack_png
from ...files.shipped import shipped
from .recipe import SHIPPED, Recipe
from .summary import Summary

TEMPLATE = "page.html"
SHOWN = 6  # pictures of a recording
SMALLER = 4  # times that they are smaller each way
LEAST_SHARE = 0.01  # of its frames that bear a flag, for a recording to be listed under it (assumed)
FLAG = "flag"


def written(recipe: Recipe, summaries: list[Summary], progress: Callable[[int, int], None]) -> str:
    """Write the page."""
    choices: dict[str, set[str]] = {}
    articles = []
    for number, one in enumerate(summaries, start=1):
        for name, text in one.labels.items():
            choices.setdefault(name, set()).update({text} - {""})
        choices.setdefault(FLAG, set()).update(_flags(one))
        articles.append(_article(one))
        progress(number, len(summaries))
    template = string.Template(shipped(f"{SHIPPED}/{TEMPLATE}").read_text("utf-8"))
    return template.substitute(
        title=escape(recipe.source.title),
        notes="".join(f"<blockquote>{escape(note)}</blockquote>" for note in recipe.notes),
        selects="".join(_select(name, sorted(texts)) for name, texts in choices.items() if texts),
        articles="".join(articles),
    )


def _select(name: str, texts: list[str]) -> str:
    options = "".join(f"<option>{escape(text)}</option>" for text in ("", *texts))
    return f'<label>{escape(name)} <select data-label="{escape(name)}">{options}</select></label>\n'


def _flags(one: Summary) -> list[str]:
    return [name for name, share in one.flagged.items() if share >= LEAST_SHARE]


def _article(one: Summary) -> str:
    """Write a recording: labels, numbers, and pictures evenly through it."""
    of = one.recording
    shares = f"{of.split}; {of.frames} frames, {one.touched:.0%} in contact, {one.guesses:.0%} guesses"
    labels = ", ".join(f"{name} {text}" for name, text in one.labels.items() if text)
    known = (("force {:.2f} N", one.force), ("confidence {:.2f}", one.confidence), ("explained {:.2f}", one.explained))
    numbers = ", ".join(words.format(value) for words, value in known if np.isfinite(value))
    flags = ", ".join(f"{name} {one.flagged[name]:.0%}" for name in _flags(one))
    frames = np.linspace(0, of.frames - 1, min(SHOWN, of.frames)).astype(int)
    data = {
        "labels": json.dumps(one.labels | {FLAG: _flags(one)}),
        "confidence": f"{np.nan_to_num(one.confidence):.4f}", "force": f"{np.nan_to_num(one.force):.4f}",
    }  # fmt: skip
    held = " ".join(f'data-{name}="{escape(value)}"' for name, value in data.items())
    lines = "".join(f"<p>{escape(line)}</p>" for line in (shares, labels, numbers, flags) if line)
    pictures = "".join(_picture(of.picture(int(frame)), int(frame) * of.every) for frame in frames)
    return f'<article id="{escape(of.name)}" {held}><h2>{escape(of.name)}</h2>{lines}{pictures}</article>\n'


def _picture(picture: np.ndarray, frame: int) -> str:
    data = base64.b64encode(pack_png(np.ascontiguousarray(picture[::SMALLER, ::SMALLER]))).decode()
    return f'<img title="frame {frame}" alt="frame {frame}" src="data:image/png;base64,{data}">'
