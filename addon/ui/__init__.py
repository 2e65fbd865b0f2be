"""Panels, menus, properties and preferences."""
