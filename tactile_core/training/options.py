"""Options of a training, which are written into its card, and the device that it runs on."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from ..errors import TactileError

if TYPE_CHECKING:
    import torch  # imported inside functions: the command line reads DEVICES without it

DEVICES = ("auto", "cpu", "cuda")  # where networks may be trained; auto: on a GPU when torch sees one
# What cuBLAS asks for before it repeats itself to the bit: NVIDIA, cuBLAS Library, "Results reproducibility".
_REPEATABLE = ("CUBLAS_WORKSPACE_CONFIG", ":4096:8")


@dataclass(frozen=True)
class Options:
    """Sizes and lengths of a training. On one core the defaults take 23 minutes for 50,000 contacts.

    latent_* : numbers in a latent; of a mesh's, two are the place of the dent
    wide_*, near_* : number of principal fields of the whole surface, and of the window that moves with the dent
    half_* : cells from that window's middle to its edge (5.6 mm on the DIGIT, 6.7 mm on the BioTac)
    width, blocks : size of the residual MLPs; batch : contacts in a step of training
    components : number of Gaussians of S2MPN's posterior over contacts (five: docs/sources.md, Networks)
    *_epochs : passes of each stage over the training contacts; `effort` multiplies all of them. More make simulated
        contacts better, not real recordings (docs/train.md)
    parts_steps : batches, times `effort`, for the network that separates two contacts; more hardly lower its error on
        held-out presses
    beta : weight of the KL divergence against a loss that is 1 for no displacement (1e-4: docs/sources.md, Networks)
    astray : weight of the distance, in cells, of a translated place on the DIGIT from the true one, against the same
        loss
    noise : counts, standard deviation of the reading; gain : relative standard deviation per channel (docs/sources.md)
    unit : share of signed training samples with a real unit's uncertainty, whose rest is found from recordings in
        contact throughout. unit_gain : standard deviation of the logarithm of a channel's gain; unit_offset : counts,
        that of its rest (10 to 60 counts between two halves of a unit's recordings; docs/units.md)
    misfit : error of each channel, as a share of the whole signal's size, in these samples and rectified ones. The
        simulated contacts nearest to real slides leave .3 of the signal, .07 per channel (commit d537259); 0.1 was
        chosen against 0.05 (docs/train.md)
    rectified : share of training samples that lose their sign (assumed). For these, rectified_gain : standard deviation
        of the logarithm of a channel's gain (0.5: a real unit's against the simulated one); rectified_offset : counts,
        that of the tare before rectifying (assumed); rectified_missing : share of channels without reading (assumed)
    silence : share of training samples without contact: no displacement, signals of noise alone (assumed)
    mirrored : share of mirrored training samples, as both sensors are symmetric in z
    without : names of indenters left out of the training; without_below_x : m, contacts at smaller x on the pad are
        left out
    left_out : stages that are not run; their networks keep their initial weights
    weight_decay : AdamW's; rectified_decay : R2MPN's, which over-fits rectified signals otherwise
    rate : largest learning rate
    checkpoint_seconds : least time between two checkpoints; does not change the result"""

    latent_signal: int = 16
    latent_biotac: int = 128
    latent_digit: int = 128
    wide_biotac: int = 48
    near_biotac: int = 160
    half_biotac: int = 12
    wide_digit: int = 64
    near_digit: int = 224
    half_digit: int = 16
    width: int = 256
    blocks: int = 2
    components: int = 5
    batch: int = 128
    rate: float = 1.5e-3
    weight_decay: float = 1e-2
    rectified_decay: float = 0.2
    beta: float = 1e-4
    astray: float = 0.2
    noise: float = 1.5  # sensors.readout.NOISE, which numpy would come with
    gain: float = 0.1
    unit: float = 0.3
    unit_gain: float = 0.3
    unit_offset: float = 20.0
    misfit: float = 0.1
    rectified: float = 0.25
    rectified_gain: float = 0.4
    rectified_offset: float = 3.0
    rectified_missing: float = 0.1
    silence: float = 0.05
    mirrored: float = 0.5
    without: tuple[str, ...] = ()
    without_below_x: float | None = None
    left_out: tuple[str, ...] = ()
    effort: float = 1.0
    svb_epochs: int = 6
    mvb_epochs: int = 6
    mvd_epochs: int = 9
    s2mpn_epochs: int = 18
    m2mpn_epochs: int = 3
    chain_epochs: int = 13
    direct_epochs: int = 13
    force_epochs: int = 6
    pressure_epochs: int = 6
    error_epochs: int = 2
    back_epochs: int = 5
    parts_steps: int = 8000
    checkpoint_seconds: float = 30.0

    def epochs(self, stage: str) -> int:
        """Return the passes over the data in a stage, such as "SVB", at least one unless the stage is left out."""
        if stage in self.left_out:
            return 0
        return max(1, round(self.effort * getattr(self, f"{stage.lower()}_epochs")))

    def decay(self, net: str) -> float:
        """Return the weight decay of the network `net`."""
        return self.rectified_decay if net.startswith("R2MPN") else self.weight_decay

    def settings(self) -> dict[str, object]:
        """Return all options that change the result, as JSON reads them back."""
        settings = asdict(self) | {"without": list(self.without), "left_out": list(self.left_out)}
        settings.pop("checkpoint_seconds")
        return settings


def device_of(name: str) -> torch.device:
    """Return the torch device auto, cpu or cuda. Raises TactileError for others, or a GPU that torch does not see."""
    import torch

    if name not in DEVICES:
        raise TactileError("device", repr(name), ", ".join(DEVICES))
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        found = f"torch {torch.__version__} sees none"
        raise TactileError("device cuda", found, "a GPU", "Install torch for it, or leave the device to auto")
    if name == "cpu" or not there:
        return torch.device("cpu")
    os.environ.setdefault(*_REPEATABLE)
    return torch.device("cuda")


def label(device: torch.device) -> str:
    """Return the device's name, for a card: numbers depend on it."""
    import torch

    return torch.cuda.get_device_name(device) if device.type == "cuda" else device.type
