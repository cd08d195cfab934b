"""Training for examples/denoiser.py: three networks side by side on the same clean patches, each with noise of its own."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
import torch
from denoiser_pairs import NOISES, PUBLISHED, Pairs
from small_unet import SmallUnet

LEARNING_RATE = 4e-3
LEAST_ERROR = 1e-7  # 70 dB: keeps the logarithm of a black patch finite
WARM_UP = 0.05  # share of the steps over which the rate rises; then it falls as a cosine to 0
LOOKS = 12  # points of the curve


@dataclass
class Arm:
    """A network that is being trained on one kind of noise.

    curve: (step, PSNR [dB] on the pairs that watch it).
    """

    noise: str
    network: SmallUnet
    optimizer: torch.optim.Optimizer
    curve: list[tuple[int, float]] = field(default_factory=list)

    @classmethod
    def begun(cls, noise: str, seed: int) -> "Arm":
        """Weights that depend on the seed alone, so that all arms begin alike."""
        torch.manual_seed(seed)
        network = SmallUnet()
        return cls(noise, network, torch.optim.Adam(network.parameters()))

    def step(self, pairs: Pairs, rate: float) -> None:
        """One step up the PSNR, the mean over the pairs of a batch."""
        self.optimizer.param_groups[0]["lr"] = rate
        self.optimizer.zero_grad()
        error = self.network(torch.from_numpy(pairs.noisy[self.noise])) - torch.from_numpy(pairs.clean)
        loss = torch.log(error.square().mean(dim=(1, 2, 3)) + LEAST_ERROR).mean()
        loss.backward()
        self.optimizer.step()

    def look(self, step: int, watched: Pairs) -> None:
        """Add a point to the curve."""
        psnr = psnr_db(denoised(self.network, watched.noisy[PUBLISHED]), watched.clean)
        self.curve.append((step, float(psnr.mean())))


def trained(batches: Iterable[Pairs], steps: int, seed: int, watched: Pairs, tell: Callable[[], None]) -> list[Arm]:
    """Train a network on each kind of noise, all on one batch after the other.

    watched: pairs whose PSNR under the published model is the curve. tell: called after a step.
    """
    arms = [Arm.begun(noise, seed) for noise in NOISES]
    for step, pairs in zip(range(1, steps + 1), batches, strict=False):
        for arm in arms:
            arm.step(pairs, LEARNING_RATE * learning_rate_share((step - 0.5) / steps))
            if step % max(1, steps // LOOKS) == 0:
                arm.look(step, watched)
        tell()
    return arms


def learning_rate_share(progress: float) -> float:
    """Rate over its largest value at a share of the steps: a linear rise, then half a cosine."""
    if progress < WARM_UP:
        return progress / WARM_UP
    return 0.5 + 0.5 * math.cos(math.pi * (progress - WARM_UP) / (1.0 - WARM_UP))


def denoised(network: SmallUnet, planes: np.ndarray) -> np.ndarray:
    """Clean planes as a network sees them, (samples, 4, height, width)."""
    with torch.no_grad():
        return np.concatenate([network(part).numpy() for part in torch.from_numpy(planes).split(8)])


def psnr_db(planes: np.ndarray, clean: np.ndarray) -> np.ndarray:
    """Peak signal-to-noise ratio of each sample, clipped to 0 .. 1 and against a peak of 1 [dB], (samples,)."""
    error = np.clip(planes, 0.0, 1.0).astype(np.float64) - clean
    return -10.0 * np.log10(np.square(error).mean(axis=(1, 2, 3)))
