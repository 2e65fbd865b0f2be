"""Scenes to recordings and to paired contacts of both sensors."""
