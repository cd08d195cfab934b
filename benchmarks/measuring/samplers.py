"""Poisson samplers as OpenCL expressions, and their exact distributions.

A sampler is deterministic in a random number: a normal w or a uniform word. Its distribution follows without sampling:
where the count steps from k - 1 to k in w is found by bisection with the sampler's own arithmetic, and the probability
between two steps is the normal distribution's in float64, or the number of words between them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import special, stats

from simulator.device import Buffer, Device
from simulator.device.kernel_source import expanded
from simulator.sensor.stages.poisson_variants import (
    MACROS,
    POISSON_BRIGHT_E,
    POISSON_SWITCH_E,
    SMALL_MEANS_E,
    SMALL_VARIANTS,
    PoissonVariant,
)

SQUARE_ROOT = "const float r = reciprocal_square_root(mean), root = mean * r;"
GILES_1 = "mean + (root * w + (1.0f / 3.0f + w * w * (1.0f / 6.0f)))"
GILES_2 = "mean + (root * w + (1.0f / 3.0f + w * w * (1.0f / 6.0f) - r * w * (1.0f / 36.0f + w * w * (1.0f / 72.0f))))"


@dataclass(frozen=True)
class Sampler:
    """Counts from a mean [e-].

    draw: OpenCL statement that sets `count` from mean and the words random.a, random.b.
    of_normal: the same from a normal number w; empty where the count does not come from one.
    of_word: the same from one uniform word.
    low, high: means it is for, low <= mean < high.
    """

    name: str
    draw: str
    of_normal: str = ""
    of_word: str = ""
    low: float = 0.0
    high: float = np.inf


_WORD = "const float w = 0.0f, light = mean;"
_NORMAL = (  # as in the sensor, light comes after a number
    "const float w = normal_one(random.a, random.b); const float light = as_float(as_uint(mean) ^ zero_after(w));"
)


def _shortcut(name: str, expression: str) -> Sampler:
    count = f"{SQUARE_ROOT} const float count = (float)(int)larger(0.0f, {expression});"
    return Sampler(name, f"{_NORMAL} {count.replace('mean', 'light')}", of_normal=count, low=1e-30)


SHORTCUTS = (
    _shortcut("normal, rounded", "mean + root * w + 0.5f"),
    _shortcut("Giles Q1, floor", GILES_1),
    _shortcut("Giles Q2, floor", GILES_2),
)


def photosite(variant: PoissonVariant) -> Sampler:
    """The sampler of kernels/poisson.h in one of its variants."""
    small = dict(zip(SMALL_VARIANTS, SMALL_MEANS_E, strict=True))
    large = {PoissonVariant.LARGE: POISSON_SWITCH_E, PoissonVariant.BRIGHT: POISSON_BRIGHT_E}
    return Sampler(
        f"Photosite, {variant.name.lower()} means",
        f"{_WORD if variant in SMALL_VARIANTS else _NORMAL} const float count = poisson(light, w, random.c, {int(variant)});",
        of_normal=f"const float count = poisson_expansion(mean, reciprocal_square_root(mean), w, {int(variant)});",
        of_word=f"const float count = poisson(mean, 0.0f, word, {int(variant)});",
        low=large.get(variant, 0.0),
        high=small.get(variant, np.inf),
    )


class Probe:
    """Runs a statement that sets `count` over arrays."""

    def __init__(self, device: Device, statement: str, argument: str = "") -> None:
        self.device, self.argument = device, argument
        kind = {"w": "float", "word": "uint"}.get(argument)
        buffer = f"global const {kind} *{argument}_, " if kind else ""
        value = f"const {kind} {argument} = {argument}_[i];" if kind else _RANDOM
        source = (
            f'#include "philox.h"\n#include "poisson.h"\nkernel void probe(global const float *mean_, {buffer}'
            f"global float *count_, const uint seed) {{ const size_t i = get_global_id(0); const float mean = mean_[i]; "
            f"{value} {statement} count_[i] = count; }}"
        )
        self.kernel = device.build(expanded(source), "probe", MACROS)

    def enqueue(self, means: Buffer, counts: Buffer, size: int, seed: int = 1, **more: Buffer) -> None:
        """Run on device buffers of `size` numbers."""
        local = (min(self.device.row_px, size),) if size % self.device.row_px == 0 else None
        self.device.run(self.kernel, (size,), local, mean_=means, count_=counts, seed=seed, **more)

    def of(self, mean: float, values: np.ndarray) -> np.ndarray:
        """Counts for one mean and these normals or words."""
        counts, size = self.device.empty(values.shape, np.float32), len(values)
        means = self.device.upload(np.full(size, mean, np.float32))
        self.enqueue(means, counts, size, **{f"{self.argument}_": self.device.upload(values)})
        return self.device.download(counts, values.shape, np.float32)


_RANDOM = "const struct words counter = {(uint)i, 0u, 0u, 0u}; const struct words random = philox(counter, seed, 0u);"
FARTHEST = np.float32(6.8)  # kernels/normal.h reaches 6.7 sigma


def _ordered(w: np.ndarray) -> np.ndarray:
    """Float32 as integers that rise with them."""
    bits = w.view(np.int32).astype(np.int64)
    return np.where(bits < 0, -(bits & 0x7FFFFFFF), bits)


def _floats(order: np.ndarray) -> np.ndarray:
    """Inverse of _ordered."""
    return np.where(order < 0, -order | 0x80000000, order).astype(np.uint32).view(np.float32)


def _steps(probe: Probe, mean: float, grid: np.ndarray, order: Callable, value: Callable) -> tuple[np.ndarray, ...]:
    """Counts before each step, found by bisection of a grid, and the values on both sides of it as `order` numbers them."""
    counts = probe.of(mean, grid).astype(np.int64)
    steps = np.flatnonzero(np.diff(counts))
    low, high, left = order(grid[steps]), order(grid[steps + 1]), counts[steps]
    while len(low) and (high - low > 1).any():  # the count leaves `left` in (low, high]
        middle = (low + high) // 2
        stays = probe.of(mean, value(middle)) == left
        low, high = np.where(stays, middle, low), np.where(stays, high, middle)
    return np.concatenate([left, counts[-1:]]), low, high


def _distribution(values: np.ndarray, below: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Counts and their probabilities from the probability before each step."""
    shares = np.diff(np.concatenate([[0.0], below, [1.0]]))
    support = np.arange(values.min(), values.max() + 1)
    return support, np.bincount(values - values.min(), weights=shares)


def from_normals(probe: Probe, mean: float) -> tuple[np.ndarray, np.ndarray]:
    """Counts and their probabilities (float64) of a sampler that counts from a normal number, which it need not do in order."""
    grid = np.linspace(-FARTHEST, FARTHEST, 2**18, dtype=np.float32)  # far finer than the steps at a mean of 1e6
    values, low, high = _steps(probe, mean, grid, _ordered, _floats)
    return _distribution(values, special.ndtr(0.5 * (_floats(low).astype(np.float64) + _floats(high))))


def from_words(probe: Probe, mean: float) -> tuple[np.ndarray, np.ndarray]:
    """The same for one that counts from a word: a grid that is finer towards its least words, where counts are large."""
    grid = np.unique(np.concatenate([[0], np.geomspace(1, 2**32 - 1, 2**18)]).astype(np.uint32))
    values, _, high = _steps(probe, mean, grid, lambda words: words.astype(np.int64), lambda order: order.astype(np.uint32))
    return _distribution(values, high / 2.0**32)


def errors(counts: np.ndarray, shares: np.ndarray, mean: float) -> tuple[float, float]:
    """Total variation distance to the Poisson distribution of this (float32) mean, and relative error of the variance."""
    mean = float(np.float32(mean))
    exact = stats.poisson.pmf(counts, mean)
    distance = 0.5 * (np.abs(shares - exact).sum() + 1.0 - exact.sum())
    centre = (counts * shares).sum()
    variance = ((counts - centre) ** 2 * shares).sum()
    return float(distance), float(variance / mean - 1.0) if mean else float(variance)
