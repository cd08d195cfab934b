"""Compositing of deep samples into few layers: overlapping samples are split and merged, then each depth range is one layer.

Rules of P. Hillman, "Interpreting OpenEXR Deep Pixels" (OpenEXR documentation). A part f of a volume of alpha a has the alpha
1 - (1 - a)^f and the colour in proportion to its alpha. Samples that fill the same range have 1 - prod(1 - a_i) together,
and the colour w * sum(c_i v_i) with u_i = -ln(1 - a_i), v_i = u_i / a_i, w = a / sum(u_i); the opaque ones alone count,
by their mean, where there are any. Surfaces of one depth lie over one another in the file's order.
"""

from dataclasses import dataclass

import numpy as np

from simulator.scene.deep_file import DeepSamples
from simulator.scene.deep_pixels import DeepPixels
from simulator.scene.depth_holes import nearest_known
from simulator.scene.scene import Layer

JOINED = 1.01  # ratio of the depths that one layer joins above which a pixel is counted
BINS = 256  # of inverse depth, in which the borders between layers are looked for


def deep_layers(samples: DeepSamples, most: int) -> tuple[tuple[Layer, ...], float]:
    """Return at most this many layers, nearest first, and the share of covered pixels where one joins depths over 1 % apart.

    A layer holds at each pixel the composite of all samples between two depths, and their mean 1/depth, weighted by what each
    adds to the coverage. The composite of the layers is that of all samples. samples: one or more, depths in m.
    """
    borders = _borders_m(samples, most)
    samples = _merge(_split(samples, borders))
    slab = np.searchsorted(borders, samples.near, side="right")
    joined = np.zeros(samples.size[0] * samples.size[1], bool)
    layers = []
    for index in range(len(borders) + 1):
        chosen = slab == index
        if chosen.any():
            layers.append(_layer(_select(samples, chosen), joined))
    return tuple(layers), float(joined.sum() / len(np.unique(samples.pixel)))


def deep_pixels(samples: DeepSamples) -> DeepPixels:
    """Return the samples sorted by pixel and from front to back, unmerged but for volumes that overlap, which are split."""
    samples = _merge(_split(samples, np.empty(0)))
    count = np.bincount(samples.pixel, minlength=samples.size[0] * samples.size[1])
    starts = np.concatenate([[0], np.cumsum(count)])
    planes, alpha = samples.colour.astype(np.float32), samples.alpha.astype(np.float32)
    return DeepPixels(starts, samples.size[1], planes, alpha, samples.near, samples.far)


def _borders_m(samples: DeepSamples, most: int) -> np.ndarray:
    """Return the depths between layers, ascending (at most `most` - 1): natural breaks of 1/depth, weighted by alpha.

    The division with the least variance within the classes (Fisher 1958, J. Am. Stat. Assoc. 53, 789), over a histogram.
    """
    inverse = 0.5 / samples.near + 0.5 / samples.far
    low, high = inverse.min(), inverse.max()
    if not high > low or most == 1:
        return np.empty(0)
    edges = np.linspace(low, high, BINS + 1)
    weight = np.histogram(inverse, edges, weights=samples.alpha + 1e-12)[0]
    centre = 0.5 * (edges[1:] + edges[:-1]) / high
    s0, s1, s2 = (np.concatenate([[0.0], np.cumsum(weight * centre**power)]) for power in range(3))
    scatter = np.full((BINS + 1, BINS + 1), np.inf)  # [i, j]: sum of squares of bins i to j - 1 about their mean
    for i in range(BINS):
        mass = np.maximum(s0[i + 1 :] - s0[i], 1e-300)
        scatter[i, i + 1 :] = np.maximum(s2[i + 1 :] - s2[i] - (s1[i + 1 :] - s1[i]) ** 2 / mass, 0.0)
    best, cuts = scatter[0], []
    for _ in range(most - 1):
        total = best[:, None] + scatter
        cuts.append(total.argmin(axis=0))
        best = total.min(axis=0)
    found, end = [], BINS
    for before in reversed(cuts):
        end = int(before[end])
        found.append(end)
    inner = sorted({bin_ for bin_ in found if 0 < bin_ < BINS}, reverse=True)
    return 1.0 / edges[inner]


@dataclass
class _Keys:
    """Depths by rank, so that a pixel and a depth make one integer that sorts by pixel, then by depth."""

    depths: np.ndarray

    def of(self, pixel: np.ndarray, depth: np.ndarray) -> np.ndarray:
        return pixel * len(self.depths) + np.searchsorted(self.depths, depth)

    def depth(self, key: np.ndarray) -> np.ndarray:
        return self.depths[key % len(self.depths)]


def _split(samples: DeepSamples, borders_m: np.ndarray) -> DeepSamples:
    """Split volumes where another sample of the same pixel begins or ends, and at the borders between layers."""
    volumes = samples.far > samples.near
    if not volumes.any():
        return samples
    keys = _Keys(np.unique(np.concatenate([samples.near, samples.far, borders_m])))
    first, last = keys.of(samples.pixel, samples.near), keys.of(samples.pixel, samples.far)
    pixels = np.unique(samples.pixel[volumes])
    everywhere = keys.of(np.repeat(pixels, len(borders_m)), np.tile(borders_m, len(pixels)))
    ends = np.unique(np.concatenate([first, last, everywhere]))
    start, stop = np.searchsorted(ends, first), np.searchsorted(ends, last)
    pieces = np.maximum(stop - start, 1)
    own = np.repeat(np.arange(len(pieces)), pieces)
    place = start[own] + np.arange(len(own)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    near = keys.depth(ends[place])
    far = np.where(volumes[own], keys.depth(ends[np.minimum(place + 1, len(ends) - 1)]), near)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(volumes[own], (far - near) / (samples.far - samples.near)[own], 1.0)
        alpha = samples.alpha[own]
        part = np.where(volumes[own], -np.expm1(share * np.log1p(-alpha)), alpha)
        factor = np.where(alpha > 0, part / alpha, share)
    return DeepSamples(samples.size, samples.pixel[own], samples.colour[own] * factor[:, None], part, near, far)


def _merge(samples: DeepSamples) -> DeepSamples:
    """Sort samples by pixel and from front to back, and merge those that fill the same range of depths."""
    order = np.lexsort((samples.far, samples.near, samples.pixel))
    samples = _select(samples, order)
    new = np.ones(len(order), bool)
    new[1:] = (np.diff(samples.pixel) > 0) | (samples.near[1:] != samples.near[:-1]) | (samples.far[1:] != samples.far[:-1])
    new[1:] |= samples.far[1:] == samples.near[1:]  # surfaces of one depth keep the file's order
    if new.all():
        return samples
    start, group = np.flatnonzero(new), np.cumsum(new) - 1
    opaque = samples.alpha >= 1.0
    counts = np.where(np.logical_or.reduceat(opaque, start)[group], opaque, True)  # beside an opaque one the others vanish
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.where(opaque, 1.0, -np.log1p(-samples.alpha))
        v = np.where(opaque | (samples.alpha <= 0), 1.0, u / samples.alpha) * counts
        total = np.add.reduceat(u * counts, start)
        alpha = 1.0 - np.multiply.reduceat(1.0 - samples.alpha, start)
        w = np.where(total > 0, alpha / total, 1.0)
    colour = np.add.reduceat(samples.colour * v[:, None], start, axis=0) * w[:, None]
    single = np.diff(np.append(start, len(order))) == 1
    colour[single], alpha[single] = samples.colour[start][single], samples.alpha[start][single]
    return DeepSamples(samples.size, samples.pixel[start], colour, alpha, samples.near[start], samples.far[start])


def _layer(samples: DeepSamples, joined: np.ndarray) -> Layer:
    """Composite sorted samples front to back. joined: set to True, in place, where their depths differ by over 1 %."""
    start = np.flatnonzero(np.diff(samples.pixel, prepend=-1))
    count, pixel = np.diff(np.append(start, len(samples.pixel))), samples.pixel[start]
    colour, transmittance = np.zeros((len(start), samples.colour.shape[1])), np.ones(len(start))
    inverse, weight = np.zeros(len(start)), np.zeros(len(start))
    for depth in range(int(count.max())):
        there = count > depth
        index = start[there] + depth
        colour[there] += transmittance[there, None] * samples.colour[index]
        own = transmittance[there] * np.maximum(samples.alpha[index], 1e-12)
        inverse[there] += own * (0.5 / samples.near[index] + 0.5 / samples.far[index])
        weight[there] += own
        transmittance[there] *= 1.0 - samples.alpha[index]
    joined[pixel[samples.near[start] * JOINED < samples.near[start + count - 1]]] = True
    height, width = samples.size
    planes = np.zeros((height * width, colour.shape[1]), np.float32)
    coverage, depth_m = np.zeros(height * width, np.float32), np.full(height * width, np.inf, np.float32)
    planes[pixel], coverage[pixel] = colour, 1.0 - transmittance
    with np.errstate(divide="ignore"):
        depth_m[pixel] = weight / inverse
    known = np.zeros(samples.size, bool)
    known.ravel()[pixel] = True
    depth_m = nearest_known(depth_m.reshape(samples.size), known)
    return Layer(planes.reshape(height, width, -1), depth_m, None if coverage.min() == 1.0 else coverage.reshape(samples.size))


def _select(samples: DeepSamples, index: np.ndarray) -> DeepSamples:
    arrays = (samples.pixel, samples.colour, samples.alpha, samples.near, samples.far)
    return DeepSamples(samples.size, *(array[index] for array in arrays))
