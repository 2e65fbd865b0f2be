"""The verbs of ``tactile``, one file each.

A verb is a module with BRIEF, TEXT and EPILOG (its help), LEAVES (what an interruption leaves behind, if not
``common.NOTHING``), ``arguments`` (parser) and ``run`` (options -> exit status). It imports its rooms in ``run``, so
that help costs nothing."""

from importlib import import_module

NAMES = (
    "convert", "watch", "batch", "export", "dataset", "info", "adapt", "render", "calibrate", "scenes", "simulate",
    "pairs", "train", "mesh", "doctor",
)  # fmt: skip
VERBS = {name: import_module(f".{name}", __name__) for name in NAMES}
