"""Check that LeRobot can load and train on what `tactile export` writes, and that lerobot-doctor passes it.

    python scripts/check_lerobot.py [--venv DIR]

Installs LeRobot and lerobot-doctor in a virtual environment of their own (some GB, with torch; kept with --venv),
exports the recording that ships in both of LeRobot's layouts, and runs there what a user of LeRobot would: the doctor
on each, LeRobot's own conversion of v2.1 to v3.0, and a training step of ACT and of a diffusion policy on both. Exits
with 1 if one of them fails. It is no part of .ci/run, as it fetches so much.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
PACKAGES = ("lerobot[dataset,training,diffusion]", "lerobot-doctor")
CONVERTER = "convert_dataset_v21_to_v30"
CONVERTERS = {f"lerobot.scripts.{CONVERTER}": ".", f"lerobot.datasets.v30.{CONVERTER}": ".."}  # LeRobot 0.6's, 0.4's


def main(arguments: list[str] | None = None) -> int:
    """Install LeRobot, then ``check`` what `tactile export` writes; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--venv", type=Path, metavar="DIR", help="environment to use, or to make and keep")
    parser.add_argument("--train", type=Path, metavar="DATASET", help=argparse.SUPPRESS)  # what runs in there
    options = parser.parse_args(arguments)
    if options.train:
        train(options.train)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        return check(Path(folder), options.venv or Path(folder) / "venv")


def check(folder: Path, venv: Path) -> int:
    """Export into a folder and run every check in the virtual environment ``venv``; return 1 if one fails, else 0."""
    python = install(venv)
    tactile = [sys.executable, "-m", "tactile_core"]
    call(*tactile, "batch", RECORDING, "--keep", "latent,image", "--workers", "1", "--out", folder / "job")
    failed = 0
    for layout in ("lerobot", "lerobot21"):
        made = folder / layout
        call(*tactile, "export", folder / "job", "--to", layout, "--out", made)
        failed += run(python.parent / "lerobot-doctor", "check", made)
        if layout == "lerobot21":
            name, root = next((name, root) for name, root in CONVERTERS.items() if can_find(python, name))
            words = ("--repo-id", layout, "--root", (made / root).resolve(), "--push-to-hub", "false")
            failed += run(python, "-m", name, *words)
        failed += run(python, __file__, "--train", made)
    print("failed" if failed else "LeRobot trains on both layouts, and the doctor passes them")
    return int(failed > 0)


def install(venv: Path) -> Path:
    """Return the Python of the environment ``venv``; if it is missing, make it and install PACKAGES."""
    python = venv / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    if not python.exists():
        call(sys.executable, "-m", "venv", venv)
        call(python, "-m", "pip", "install", "-q", *PACKAGES)
    return python


def train(dataset: Path) -> None:
    """Load a data set as LeRobot's training does, and take one step of each policy on the CPU; exit if a loss is not
    finite."""
    import math

    import torch  # noqa: TID251  # LeRobot's own environment
    from lerobot.configs.default import DatasetConfig
    from lerobot.configs.train import TrainPipelineConfig
    from lerobot.datasets.factory import make_dataset
    from lerobot.policies.factory import make_policy, make_policy_config, make_pre_post_processors

    small = {  # a step is to take seconds
        "act": {"dim_model": 64, "n_heads": 2, "dim_feedforward": 64},
        "diffusion": {"down_dims": (32, 64)},
    }
    for name, size in small.items():
        offline = {"device": "cpu", "push_to_hub": False, "pretrained_backbone_weights": None}
        policy_config = make_policy_config(name, **offline, **size)
        config = TrainPipelineConfig(DatasetConfig("tactile/touch", root=str(dataset)), policy=policy_config)
        data = make_dataset(config)
        policy = make_policy(policy_config, ds_meta=data.meta)
        before, _ = make_pre_post_processors(policy_config, dataset_stats=data.meta.stats)
        batch = next(iter(torch.utils.data.DataLoader(data, batch_size=4, shuffle=True)))
        optimiser = torch.optim.Adam(policy.parameters(), 1e-4)
        loss, _ = policy.forward(before(batch))
        loss.backward()
        optimiser.step()
        if not math.isfinite(loss.item()):
            raise SystemExit(f"{dataset}: the loss of {name} is {loss.item()}")
        print(f"{dataset.name}: {len(data)} frames, {name}: loss {loss.item():.3g}")


def can_find(python: Path, module: str) -> bool:
    """Return true if the Python at the path ``python`` can import a module."""
    tried = f"import importlib.util as u, sys; sys.exit(u.find_spec('{module}') is None)"
    return subprocess.call([str(python), "-c", tried], stderr=subprocess.DEVNULL) == 0


def run(*command: object) -> int:
    """Run a command; return 1 if it fails, else 0."""
    print("+", *command, flush=True)
    return int(subprocess.call([str(word) for word in command]) != 0)


def call(*command: object) -> None:
    """Run a command; end this script if it fails."""
    if run(*command):
        raise SystemExit(1)


if __name__ == "__main__":
    sys.exit(main())
