"""The verbs of ``tactile``: one file each, with its words, its arguments and the call of the room that does the work.

A verb is a module with BRIEF, TEXT and EPILOG (its help), LEAVES (what is left when it is stopped), ``arguments``
(parser) and ``run`` (options -> exit status). Its rooms are imported in ``run``, so that help costs nothing.
"""

from . import adapt, batch, convert, export, info, mesh, pairs, simulate, train, watch

_ORDER = (convert, watch, batch, export, info, adapt, simulate, pairs, train, mesh)
VERBS = {verb.__name__.rsplit(".", 1)[1]: verb for verb in _ORDER}
