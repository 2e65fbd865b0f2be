"""What can be chosen about a training; all of it is written into the card."""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Options:
    """Sizes and lengths of a training. The defaults take about ten minutes for 6,000 contacts on one core.

    epochs : stage -> passes over the training contacts; `effort` multiplies all of them
    beta : weight of the KL divergence against a loss whose null answer is 1 (1e-4: networks.md)
    noise : counts, standard deviation of the reading; gain : share, standard deviation a channel (networks.md)
    silence : share of training samples without contact: no displacement, signals of noise alone (assumed)
    weight_decay : of AdamW; rate : its largest learning rate
    checkpoint_seconds : least time between two checkpoints; does not change the result
    """

    latent_signal: int = 8
    latent_biotac: int = 32
    latent_digit: int = 64
    modes_biotac: int = 64
    modes_digit: int = 256
    width: int = 256
    blocks: int = 2
    batch: int = 64
    rate: float = 1e-3
    weight_decay: float = 1e-2
    beta: float = 1e-4
    noise: float = 1.5
    gain: float = 0.1
    silence: float = 0.05
    effort: float = 1.0
    svb_epochs: int = 60
    mvb_epochs: int = 40
    mvd_epochs: int = 60
    s2mpn_epochs: int = 30
    m2mpn_epochs: int = 30
    chain_epochs: int = 60
    direct_epochs: int = 60
    force_epochs: int = 20
    checkpoint_seconds: float = 30.0

    def epochs(self, stage: str) -> int:
        """Passes over the data in a stage, at least one."""
        return max(1, round(self.effort * getattr(self, f"{stage.lower()}_epochs")))

    def settings(self) -> dict[str, float]:
        """All options that change the result."""
        settings = asdict(self)
        settings.pop("checkpoint_seconds")
        return settings
