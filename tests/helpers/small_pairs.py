"""A small pairs file with analytic dents: enough to train on, nothing to learn physics from."""

import json
from pathlib import Path

import h5py
import numpy as np

from tactile_core.geometry.lattice import Lattice, grid_faces
from tactile_core.training.step_errors import Bodies
from tactile_core.translation.contact_frame import ContactFrame

SHAPES = {"biotac": (9, 7), "digit": (11, 8)}
# Options of a training on them, which have no mirror images.
BASES = {"wide_biotac": 8, "near_biotac": 8, "half_biotac": 3, "wide_digit": 8, "near_digit": 8, "half_digit": 3}
SMALL = {"mirrored": 0.0, "parts_steps": 10, "width": 32, "latent_biotac": 8, "latent_digit": 10, "batch": 32, **BASES}


def grid(rows: int, columns: int) -> np.ndarray:
    """(n, 3) m, a flat patch of 20 x 14 mm."""
    x, z = np.meshgrid(np.linspace(-15e-3, 5e-3, rows), np.linspace(-7e-3, 7e-3, columns), indexing="ij")
    return np.stack([x, np.full_like(x, -8e-3), z], -1).reshape(-1, 3)


def dents(rest: np.ndarray, center: np.ndarray, depth: np.ndarray, width: np.ndarray) -> np.ndarray:
    """(C, n, 3) m: a Gaussian dent along +y, with the sideways pull toward it that makes the three axes differ."""
    away = rest[None][:, :, [0, 2]] - center[:, None]
    bell = depth[:, None] * np.exp(-0.5 * np.square(away).sum(-1) / np.square(width)[:, None])
    pull = -0.2 * bell[..., None] * away / width[:, None, None]
    return np.stack([pull[..., 0], bell, pull[..., 1]], -1)


def write_pairs(
    path: Path,
    presses: int = 12,
    steps: int = 8,
    biotac: np.ndarray | None = None,
    digit: np.ndarray | None = None,
    seed: int = 0,
) -> Path:
    """Write a pairs file: each press is a path of growing depth; signals follow the gap law s = -k / gap."""
    biotac = grid(*SHAPES["biotac"]) if biotac is None else biotac
    digit = grid(*SHAPES["digit"]) if digit is None else digit
    rng = np.random.default_rng(seed)
    press = np.repeat(np.arange(presses), steps)
    share = np.tile((np.arange(steps) + 1) / steps, presses)
    center = np.stack([rng.uniform(-13e-3, 2e-3, presses), rng.uniform(-5e-3, 5e-3, presses)], -1)[press]
    radius = rng.choice([1.75e-3, 3.5e-3, 7e-3], presses)[press]
    depth = share * rng.uniform(0.4e-3, 1.2e-3, presses)[press]
    skin, gel = (
        dents(biotac, center, depth, np.sqrt(radius * 2e-3)),
        dents(digit, center, 0.8 * depth, np.sqrt(radius * depth) + 0.4e-3),
    )
    places = np.stack([rng.uniform(-14e-3, 4e-3, 19), np.zeros(19), rng.uniform(-6e-3, 6e-3, 19)], -1)
    rest_gap = rng.uniform(0.6e-3, 1.7e-3, 19)
    gap = np.maximum(rest_gap - dents(places, center, depth, np.sqrt(radius * 2e-3))[..., 1], 0.02e-3)
    signal = -0.1 * (1 / gap - 1 / rest_gap)
    stiffness = 8e3 * np.sqrt(radius / 3.5e-3)
    force = np.stack([0.05 * depth * stiffness, depth * stiffness, np.zeros_like(depth)], -1)
    scale = 1e-7
    with h5py.File(path, "w", track_order=False) as file:
        for name, values in (("biotac", skin), ("digit", gel)):
            data = file.create_dataset(f"displacement_{name}", data=np.round(values / scale).astype(np.int16))
            data.attrs["scale"] = scale
            file[f"depth_{name}"] = depth.astype(np.float32)
            file.attrs[f"{name}_nodes_sha256"] = "0" * 64
        reals = {"signal": signal, "gap": gap, "force": force, "contact_center": center, "pressure": 1e6 * depth}
        for name, values in reals.items():
            file[name] = values.astype(np.float32)
        file["contact_patch_digit"] = gel[..., 1] > 0.5 * gel[..., 1].max(1, keepdims=True)
        file["place"] = np.concatenate([center, np.zeros_like(center)], 1).astype(np.float32)
        file["slide"] = np.zeros_like(center, np.float32)
        file["press"], file["indenter"] = press.astype(np.int32), np.zeros(len(press), np.int16)
        file.attrs.update(scene="", seed=seed, version="0", indenters=json.dumps(["sphere"]))
        file.attrs.update(format="tactile-pairs-2", polarity="falls", electrodes="sheet")
    return path


def frame(sensor: str, half: int) -> ContactFrame:
    """The frame that moves over one of the small surfaces; the BioTac's nodes are turned, as on the sensor."""
    rows, columns = SHAPES[sensor]
    turn = np.linspace(-1, 1, rows * columns) if sensor == "biotac" else np.zeros(rows * columns)
    return ContactFrame(rows, columns, half, turn.astype(np.float32))


def bodies() -> Bodies:
    """The small surfaces."""
    gel = Lattice(grid(*SHAPES["digit"]), grid_faces(*SHAPES["digit"], closed=False), SHAPES["digit"])
    return Bodies(gel, grid(*SHAPES["biotac"])[:, [0, 2]])
