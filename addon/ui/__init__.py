"""Panels, menus, the workspace and the asset library."""
