"""The Blender extension: Blender imports the repository's root; all of it is in ``addon``."""

from .addon import register, unregister

__all__ = ["register", "unregister"]
