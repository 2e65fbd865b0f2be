"""Write the results of a whole run to docs: the rows as JSON, the page's tables, the plot of error over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.measured_rows import png_of, renew_tables
from tactile_core.accuracy import Row
from tactile_core.files import atomic, provenance

from .method import Method

TITLES = {
    "mechanics": "Contact mechanics", "translation": "Translation, signals to the DIGIT's gel",
    "conditions": "Translation by unit and contact",
    "pictures": "Pictures of known deformations",
    "chain": "Whole chain, signals to pictures", "peers": "Others' programs, each with its own calibration",
}  # fmt: skip
TABLE = "| method | ms a frame | MB | error | baseline | measured on |", "|---|---|---|---|---|---|"


def write_report(
    folder: Path, methods: Sequence[Method], rows: Sequence[Row], missing: dict[str, str], more: dict[str, list[str]]
) -> None:
    """Write ``benchmark.json``, the tables of ``benchmark.md``, and ``benchmark.png``, all in ``folder``.
    missing : method -> why it could not run; more : other tables of the page, text before one -> its lines"""
    about = {"machine": provenance.machine(), "missing": missing, "rows": list(rows)}
    atomic.write_json(folder / "benchmark.json", about)
    lines = {title: [as_line(each) for each in methods if each.stage == stage] for stage, title in TITLES.items()}
    tables = {f"## {title}\n": [*TABLE, *found] for title, found in lines.items() if found}
    renew_tables(folder / "benchmark.md", tables | more)
    atomic.write_bytes(folder / "benchmark.png", plot(methods))


def as_line(method: Method) -> str:
    """Return a method as a line of a Markdown table: name, ms, MB, error, baseline, and what they were measured on."""
    cells = [f"`{method.name}`", *map(short, (method.ms, method.mb))]
    cells += ["" if each is None else f"{short(each)} {method.unit}" for each in (method.error, method.baseline)]
    return "| " + " | ".join([*cells, method.of]) + " |"


def short(value: float | None) -> str:
    """Return a value as text with three of the four digits that a row keeps, from 100 on whole; "" for None."""
    if value is None:
        return ""
    kept = float(f"{value:.4g}")
    return f"{kept:,.0f}" if kept >= 100 else f"{kept:.3g}"


def plot(methods: Sequence[Method]) -> bytes:
    """Return a PNG with a panel for each stage of the translation: error over time, both axes logarithmic, a line for
    the Pareto front and one for the error of doing nothing. Conditions, of other contacts each, are bars of error."""
    from matplotlib.figure import Figure

    panels = [(stage, title, part) for stage, title in TITLES.items() for part in split(stage, methods) if part]
    columns = 3
    figure = Figure(figsize=(5.2 * columns, 4.2 * -(-len(panels) // columns)), layout="constrained")
    for number, (stage, title, part) in enumerate(panels, 1):
        axes = figure.add_subplot(-(-len(panels) // columns), columns, number)
        sensor = f", {part[0].name.split('_')[0]}" if stage == "mechanics" else ""
        (draw_bars if stage == "conditions" else draw)(axes, part, title + sensor)
    return png_of(figure)


def split(stage: str, methods: Sequence[Method]) -> list[list[Method]]:
    """Return a list for each panel of a stage's methods that have time and error; mechanics has a panel per sensor."""
    found = [each for each in methods if each.stage == stage and each.ms and each.error]
    if stage != "mechanics":
        return [found]
    return [[each for each in found if each.name.startswith(sensor)] for sensor in ("digit", "biotac")]


def draw(axes, methods: Sequence[Method], title: str) -> None:  # noqa: ANN001
    """Draw one panel: each method's error over its time, the Pareto front, and the error of doing nothing."""
    front = pareto([(each.ms, each.error) for each in methods])
    axes.step(*zip(*front, strict=True), where="post", color="tab:orange", linewidth=1, zorder=1, label="Pareto front")
    baselines = {each.baseline for each in methods if each.baseline}
    axes.axhline(max(baselines), color="grey", linestyle="--", linewidth=1, label="doing nothing")
    for number, each in enumerate(sorted(methods, key=lambda one: one.ms)):
        best = (each.ms, each.error) in front
        axes.plot(each.ms, each.error, "o", color="tab:orange" if best else "tab:blue", zorder=2)
        up = number % 2 == 0
        axes.annotate(label(each), (each.ms, each.error), xytext=(3, 4 if up else -4), textcoords="offset points",
                      rotation=40 if up else -40, va="bottom" if up else "top", fontsize=8)  # fmt: skip
    axes.set(xscale="log", yscale="log", title=title, xlabel="CPU ms a frame, one core",
             ylabel=f"error, {methods[0].unit}")  # fmt: skip
    axes.xaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")
    if max(baselines) < 10 * min(each.error for each in methods):  # fewer than two powers of ten to read
        axes.yaxis.set_minor_formatter("{x:g}")
    axes.margins(x=0.3, y=0.45)
    axes.legend(fontsize=8)


def draw_bars(axes, methods: Sequence[Method], title: str) -> None:  # noqa: ANN001
    """Draw one panel of methods that are not compared by their time: a bar for each one's error."""
    bars = axes.barh([label(each) for each in methods], [each.error for each in methods], color="tab:blue")
    axes.bar_label(bars, fmt="%.2f", padding=3, fontsize=8)
    axes.axvline(methods[0].baseline, color="grey", linestyle="--", linewidth=1, label="doing nothing")
    axes.invert_yaxis()
    axes.set(title=title, xlabel="error over that of no dent")
    axes.margins(x=0.15)
    axes.legend(fontsize=8)


def label(method: Method) -> str:
    """Return a method's label in the plot: its name without the parts that all methods of a panel share."""
    name = method.name.split("_", 1)[1] if method.stage == "mechanics" else method.name
    return name.removesuffix("_llvm_ad_rgb").removesuffix("_scalar_rgb").replace("_", " ")


def pareto(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the points (time, error) that no other point beats in both, by growing time."""
    front: list[tuple[float, float]] = []
    for point in sorted(points):
        if not front or point[1] < front[-1][1]:
            front.append(point)
    return front
