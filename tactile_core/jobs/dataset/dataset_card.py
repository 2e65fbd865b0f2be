"""Write the card of a data set (sources, estimates, how much of each label survives, licence), and its page."""

from __future__ import annotations

import base64
import json
import re
import string
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from html import escape

import numpy as np

from ...files.png_writer import pack_png
from ...files.shipped import shipped
from ...files.version import __version__
from ..export.finished_job import Finished
from . import survival
from .collected import Collected
from .recipe import SHIPPED, Recipe
from .survival import RAW, Row, Summary

MOST_WARNINGS, MOST_VALUES = 8, 12
NUMBER = re.compile(r"[\d.,]+|\bE\d+")  # by which warnings of one kind differ
GUESSED = 0.5  # of touched frames, from which on a set says in its first lines that it is a guess (assumed)
TEMPLATE = "page.html"
SHOWN = 6  # pictures of a recording
SMALLER = 4  # times that they are smaller each way
LEAST_SHARE = 0.01  # of its frames that bear a flag, for a recording to be listed under it (assumed)
FLAG = "flag"

MEASURED = """\
On simulated touches deeper than 0.3 mm half of the answers are within 0.8 mm of the place, a twelfth of the force and
an eighth of the dent's depth; its outline and the true one share 0.44 of what they cover. On a real finger beside a
force sensor the force is .93 times the true one, .48 N off. Never measured on real fingers: place, shear, and the
picture beside a real DIGIT's of the same touch. `confidence`, `explained`, `expected_error_m` and `flags` say how far
to trust each frame."""


def card_of(
    recipe: Recipe, named: str, found: Collected, source: Finished, summaries: list[Summary], rows: list[Row] | None,
    layouts: Sequence[str],
) -> str:  # fmt: skip
    """Return the card as Markdown. named : the recipe's name or file; found : files in the folder
    source : all translated recordings; rows : accuracies of classifiers, None without scikit-learn
    layouts : names of the exported layouts"""
    of = recipe.source
    sections = {
        f"# {_plain(of.title)}: as a DIGIT would have seen it": _notes(recipe, summaries, rows or []),
        "## What is here": _contents(recipe, source, found, summaries, layouts),
        "## Labels": _labels(summaries),
        "## How far to trust it": [*_trust(summaries), "", *_warnings(source)],
        "## What survives of the labels": _survives(recipe, rows),
        "## Errors": [MEASURED],
        "## Source": [
            f"- Data: {of.url or 'not stated'}", f"- Cite: {of.citation or 'not stated'}",
            f"- Licence of the recordings: {of.licence}. What is made from them is bound by it as well.",
            "- Method: Zai El Amri et al., Transferring Tactile Data Across Sensors.",
            f"- Made by tactile {__version__}: `tactile dataset {named} FOLDER --out DIR`",
        ],
    }  # fmt: skip
    return "\n".join(line for title, lines in sections.items() for line in (title, "", *lines, ""))


def _notes(recipe: Recipe, summaries: list[Summary], rows: list[Row]) -> Iterable[str]:
    """Return the card's first lines, as quotes: what a user must know before all else."""
    notes = [_plain(note) for note in recipe.notes]
    guesses = _mean(summaries, lambda one: one.guesses, touched=True)
    if guesses > GUESSED:
        notes.append(f"{guesses:.0%} of the frames in contact are guesses by their own confidence.")
    for task in dict.fromkeys(row.task for row in rows):
        notes.append(_verdict(task, {row.by: row for row in rows if row.task == task}))
    return [f"> {note}" for note in notes]


def _plain(text: str) -> str:
    """Return a text from a recipe or file as one line that Markdown does not interpret."""
    return " ".join(text.split()).replace("<", "&lt;").replace("|", "/").replace("`", "'")


def _verdict(task: str, by: dict[str, Row]) -> str:
    """Return a sentence on how much of the label `task` survives: none, less than in the electrodes, or as much.
    by : kind of features -> accuracy"""
    nulls = (RAW, survival.RANDOM, survival.ALWAYS)
    best = max((row for name, row in by.items() if name not in nulls), key=lambda row: row.right)
    source = max(by[RAW], by[survival.RANDOM], key=lambda row: row.right)
    always = by[survival.ALWAYS].right
    told = (
        f"told right in {best.right:.2f} from the {best.by}, in {source.right:.2f} from the electrodes,"
        f" in {always:.2f} by its commonest value alone"
    )
    if best.right < always + 2 * best.error:
        return f"Nothing of `{task}` can be shown to survive: {told}."
    if best.right < source.right - 2 * source.error:
        return f"Part of `{task}` survives: {told}."
    return f"`{task}` is told as well as from the electrodes, within two standard errors: {told}."


def _contents(
    recipe: Recipe, source: Finished, found: Collected, summaries: list[Summary], layouts: Sequence[str]
) -> Iterable[str]:
    for split in dict.fromkeys(one.recording.split for one in summaries):
        frames = [one.recording.frames for one in summaries if one.recording.split == split]
        yield f"- {split}: {len(frames)} recordings, {sum(frames)} frames"
    every = source.recordings[0].every
    yield f"- one in {every} frames of the recordings" if every > 1 else "- all frames of the recordings"
    yield f"- layouts: {', '.join(layouts)}; `index.html` to look at all recordings"
    if recipe.unit.found != "none":
        yield "- `units/`: how each finger was read"
    if found.others:
        yield f"- {found.others} other files of the folder were left alone"
    yield from (f"- set aside: {_plain(name)}: {_plain(why)}" for name, why in source.aside.items())


def _labels(summaries: list[Summary]) -> Iterable[str]:
    yield from ("| label | values (frames) |", "|---|---|")
    for name in sorted({name for one in summaries for name in one.recording.labels}):
        counts: Counter[str] = Counter()
        for one in summaries:
            texts = one.recording.labels.get(name, np.full(one.recording.frames, ""))
            counts.update(text or "(none)" for text in texts)
        if len(counts) > MOST_VALUES and (span := _span(counts)):
            yield f"| {name} | {span} |"
            continue
        shown = ", ".join(f"{_plain(text)} ({count})" for text, count in counts.most_common(MOST_VALUES))
        more = f" and {len(counts) - MOST_VALUES} more" if len(counts) > MOST_VALUES else ""
        yield f"| {name} | {shown}{more} |"


def _span(counts: Counter[str]) -> str:
    """Return the range of a label whose values are numbers, in words; "" if not all are. counts : value -> frames"""
    try:
        numbers = [float(text) for text in counts if text != "(none)"]
    except ValueError:
        return ""
    return f"{min(numbers):g} to {max(numbers):g} ({counts.total() - counts['(none)']}), none ({counts['(none)']})"


def _trust(summaries: list[Summary]) -> Iterable[str]:
    yield from ("| of all frames | share |", "|---|---|")
    yield f"| in contact | {_mean(summaries, lambda one: one.touched):.2f} |"
    guesses = _mean(summaries, lambda one: one.guesses, touched=True)
    yield f"| guesses (confidence below .5), of those in contact | {guesses:.2f} |"
    for name in sorted({name for one in summaries for name in one.flagged}):
        yield f"| flag `{name}` | {_mean(summaries, lambda one: one.flagged.get(name, 0.0)):.2f} |"  # noqa: B023
    known = [one.explained for one in summaries if np.isfinite(one.explained)]
    if known:
        low, middle, high = np.percentile(known, [10, 50, 90])
        words = "of the electrodes' change, explained by the translation, median recording (tenths)"
        yield f"| {words} | {middle:.2f} ({low:.2f} to {high:.2f}) |"


def _warnings(source: Finished) -> Iterable[str]:
    """Yield a line for each kind of warning, the commonest first; kinds ignore numbers and file names."""
    kinds: dict[str, list[str]] = {}
    for texts in source.warnings.values():
        for text in texts:
            kinds.setdefault(NUMBER.sub("", text.partition(": ")[2] or text), []).append(text)
    said = sorted(kinds.values(), key=len, reverse=True)
    for texts in said[:MOST_WARNINGS]:
        yield f"- {len(texts)} times, such as: {_plain(texts[0])}"
    if len(said) > MOST_WARNINGS:
        yield f"- {len(said) - MOST_WARNINGS} other kinds of warnings: `note.json` of each layout"


def _survives(recipe: Recipe, rows: list[Row] | None) -> Iterable[str]:
    if rows is None:
        yield "Not measured: scikit-learn is not installed (`pip install scikit-learn`, then the same command)."
        return
    if not rows:
        yield "Nothing to measure: no label of the recipe's `tasks` has several values in enough recordings."
        return
    apart = f"all of one `{recipe.split.kept}`" if recipe.split.kept else "single recordings"
    yield f"Share told right by a support vector machine (RBF, chosen within training), {apart} left out together, from"
    yield "changes since the first 0.1 s alone. Random maps are of the electrodes, 24 numbers each."
    yield from ("", "| label (values) | told by | right | standard error | examples |", "|---|---|---|---|---|")
    for row in rows:
        yield f"| {row.task} ({row.classes}) | {row.by} | {row.right:.2f} | {row.error:.2f} | {row.examples} |"


def _mean(summaries: list[Summary], value: Callable[[Summary], float], *, touched: bool = False) -> float:
    """Return the mean of value(summary), a share, over all frames, or over frames in contact if `touched` is true."""
    weights = [one.recording.frames * (one.touched if touched else 1.0) for one in summaries]
    return float(np.average([value(one) for one in summaries], weights=weights)) if sum(weights) else 0.0


def page_of(recipe: Recipe, summaries: list[Summary], progress: Callable[[int, int], None]) -> str:
    """Return the page, a self-contained HTML file with a strip of pictures for each recording.
    progress : called with (recordings done, in all)"""
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
    """Return a recording's part of the page: labels, numbers, and pictures spread evenly over its frames."""
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
