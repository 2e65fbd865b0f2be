"""Work beside Blender: worker processes, readers, tracers, the command line of ``blender -b``."""
