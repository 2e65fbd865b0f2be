"""The verbs of ``tactile``: one file each, with its words, its arguments and the call of the room that does the work. A
verb is a module with BRIEF, TEXT and EPILOG (its help), LEAVES (what is left when it is stopped), ``arguments``
(parser) and ``run`` (options -> exit status). Its rooms are imported in ``run``, so that help costs nothing."""

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
