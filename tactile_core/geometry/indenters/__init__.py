"""Rigid indenters by signed distance. To add one takes one file here and one row in a test.

In its own frame an indenter touches the plane z = 0 at the origin from above: its body lies at z >= 0.
"""

from .box import Box
from .bumpy_cube import BumpyCube
from .cylinder import Cylinder
from .edge import Edge
from .indenter import Indenter, Pose, pose_on
from .lying_cylinder import LyingCylinder
from .mesh_indenter import MeshIndenter, as_indenter
from .ring import Ring
from .several import Several
from .sphere import Sphere

__all__ = [
    "Box",
    "BumpyCube",
    "Cylinder",
    "Edge",
    "Indenter",
    "LyingCylinder",
    "MeshIndenter",
    "Pose",
    "Ring",
    "Several",
    "Sphere",
    "as_indenter",
    "pose_on",
]
