"""The verbs of ``tactile``, one file each.

A verb is a module with BRIEF, TEXT and EPILOG (its help), LEAVES (what an interruption leaves behind), ``arguments``
(parser) and ``run`` (options -> exit status). It imports its rooms in ``run``, so that help costs nothing."""

from . import (
    adapt,
    batch,
    calibrate,
    convert,
    dataset,
    doctor,
    export,
    info,
    mesh,
    pairs,
    render,
    scenes,
    simulate,
    train,
    watch,
)

ALL = (
    convert,
    watch,
    batch,
    export,
    dataset,
    info,
    adapt,
    render,
    calibrate,
    scenes,
    simulate,
    pairs,
    train,
    mesh,
    doctor,
)
VERBS = {verb.__name__.rsplit(".", 1)[1]: verb for verb in ALL}
