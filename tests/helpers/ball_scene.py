"""A scene of one ball that presses and moves: the least that can be simulated."""


def ball_scene(*points: tuple[float, float, float, float], radius_mm: float = 3.5) -> str:
    """The text of scene.toml; points : (time s, x mm, z mm, force N)."""
    lines = ["    {{ time_s = {}, x_mm = {}, z_mm = {}, force_n = {} }},\n".format(*point) for point in points]
    return f"""format = "tactile-scene-1"
name = "short"
description = "One press."
[[indenters]]
kind = "sphere"
name = "ball"
radius_mm = {radius_mm}
[recording]
indenter = "ball"
points = [
{"".join(lines)}]
"""
