"""Translate touch between robot fingertips: BioTac electrode signals to DIGIT pictures, through deformation.

From a recording to an array of camera pictures:

    import tactile_core as tactile
    recording = tactile.read("touch.csv")                               # 19 electrodes, 100 Hz
    touch = tactile.translate(recording)                                # deformation (T, nodes, 3) m, force (T, 3) N
    renderer = tactile.Renderer(preset="fast")                          # camera and lights of the shipped DIGIT
    pictures = renderer.render(touch.displacement_digit)                # (T, 320, 240, 3) uint8

From an indenter to a picture:

    ball = tactile.indenters.Sphere(radius=3e-3)                        # m
    contact = tactile.solve("digit", ball, tactile.Placement(x=-6e-3, z=0.0), force=2.0)
    picture = renderer.render(contact.displacement)                     # (320, 240, 3) uint8

From a simulator's poses to contacts and pictures, step by step:

    gel = tactile.Gel("digit", indenter=ball)
    contact = gel.press(pose)                                           # 4 x 4, or (position, quaternion)
    picture = gel.picture()

SI units throughout; time is the first axis. Importing this package loads the standard library alone: each name below
loads what it needs when it is first used. ``help(tactile.translate)`` and the like describe arguments and errors.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from .files.version import __version__ as __version__

if TYPE_CHECKING:
    from .errors import TactileError as TactileError
    from .geometry import indenters as indenters
    from .jobs.gel import Gel as Gel
    from .mechanics.placement import Placement as Placement
    from .mechanics.solve import solve as solve
    from .pictures.renderer import Renderer as Renderer
    from .recordings.readers import read as read
    from .sensors.calibration_file import load_calibration as load_calibration
    from .translation.translate import translate as translate

_HOME = {  # of each public name: its module, and its name there; none for the module itself
    "Gel": (".jobs.gel", "Gel"),
    "Placement": (".mechanics.placement", "Placement"),
    "Renderer": (".pictures.renderer", "Renderer"),
    "TactileError": (".errors", "TactileError"),
    "indenters": (".geometry.indenters", None),
    "load_calibration": (".sensors.calibration_file", "load_calibration"),
    "read": (".recordings.readers", "read"),
    "solve": (".mechanics.solve", "solve"),
    "translate": (".translation.translate", "translate"),
}
__all__ = [
    "Gel", "Placement", "Renderer", "TactileError", "indenters", "load_calibration", "read", "solve", "translate",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import a public name at its first use (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; its public names: {', '.join(__all__)}")
    path, attribute = _HOME[name]
    module = importlib.import_module(path, __name__)
    globals()[name] = value = module if attribute is None else getattr(module, attribute)
    return value


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
