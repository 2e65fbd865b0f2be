"""Scenes as inputs of a job: the scene's file and the meshes that it names, with their hashes."""

from __future__ import annotations

import os
from pathlib import Path

from ...errors import TactileError
from ...files import provenance
from ...simulation.indenter_specs import MeshSpec, SeveralSpec
from ...simulation.scene import Scene, load_scene
from .inputs import Input, content_hash


def read_inputs(scene_path: str | os.PathLike, names: list[str]) -> tuple[Scene, str, list[Input], list[str]]:
    """Read a scene; return it, its text, an input for each of some names, and the hashes of its meshes in order.

    Raises TactileError for a bad scene.
    """
    scene, text = load_scene(scene_path)
    file = Path(scene_path).resolve()
    file = file / "scene.toml" if file.is_dir() else file
    digest, size = content_hash(file)
    inputs = [Input(f"{index:05d}_{name}", str(file), digest, size) for index, name in enumerate(names)]
    return scene, text, inputs, _hashes(scene)


def load(one: Input, files: tuple[str, ...]) -> tuple[Scene, str]:
    """Load an input's scene and its text. Raises TactileError where it or a mesh changed since the job was made."""
    scene, text = load_scene(one.path)
    if content_hash(Path(one.path))[0] != one.sha256 or tuple(_hashes(scene)) != files:
        found = "another content than when the job was made"
        raise TactileError(one.path, found, f"sha256 {one.sha256[:12]}... and the same meshes", "Start a new job")
    return scene, text


def _hashes(scene: Scene) -> list[str]:
    bodies = []
    for spec in scene.indenters:
        bodies += [part.body for part in spec.parts] if isinstance(spec, SeveralSpec) else [spec]
    return [provenance.sha256(body.file) for body in bodies if isinstance(body, MeshSpec)]
