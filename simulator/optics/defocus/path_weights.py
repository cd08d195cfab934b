"""Weights of the samples behind a blur circle, of a picture of one pixel per photosite that was swept along a path.

A photosite sees the light L, bilinear between the pixels, through the image D of the aperture and along its path P: on the
pixels around it, the weights D * P * T at their middles, T the tent of a pixel, are exact. What is swept first has P * T at the
middles of the photosites, so that weights W of the samples lead to W * (P * T) of the pixels, a sum. Even squares, which W is
at rest, have a twelfth of a pixel's square of variance along each axis, whatever the path is; what lacks is between nothing and
a sixth. These W come nearest to the exact weights, by the mean square that random pixels show.

Inside a large image all samples count alike, as even squares do there, so that running sums read it: only those at its rim
have weights of their own. Where photosites have several paths, as the lines of a rolling shutter, one W is nearest to all.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from simulator.optics.defocus.photosite_area import ReadPath, Way

SMALL = 1e-3  # weight of the condition that the weights of samples are little
EVEN = 1e-6  # difference of weights inside an image that are the same, and weights of samples beside it, as a share of them
LEAST_PARTS, RADIUS_IN_PARTS = 16, 12.0  # least parts per pixel and axis, and blur radius in these, of the exact weights
SMALL_PX = 1 / 32  # radius below which a circle changes weights in proportion: parts would be too many [photosites]
# Areas in parts times means over parts have a sixth of a part's square of variance too much along each axis: three points take
# it.
SHARPER = np.array([-1.0, 14.0, -1.0]) / 12.0

ImageOf = Callable[[float], np.ndarray]
Lattice = tuple[np.ndarray, np.ndarray]


def path_weights(image_of: ImageOf, radius_px: float, path: ReadPath) -> np.ndarray:
    """Weights of the samples around a photosite: (n, n) float64, sum 1.

    image_of: returns the weights of samples that are values of smooth light, by the signed blur radius [samples]. radius_px:
    signed blur radius [photosites].
    """
    return fit_weights(image_of(radius_px), lattices(image_of, radius_px, path.ways), path)


def lattices(image_of: ImageOf, radius_px: float, ways: Sequence[Way]) -> list[Lattice]:
    """Weights of pixels by each path alone, and exact ones with the image of the aperture: two of (n, n) float64, sum 1.

    The photosite's own pixel, less whole pixels by which all of a path lies beside it, is in the middle. n has room for the
    image, and for two samples more on each side of it. A small circle shows where the light between pixels bends, by its mean
    distance from there: in proportion to its radius, or less.
    """
    share = min(abs(radius_px) / SMALL_PX, 1.0)
    per_px = max(math.ceil(RADIUS_IN_PARTS * share / abs(radius_px)), LEAST_PARTS)
    image = _sharpened(image_of(per_px * radius_px / share))
    reach = math.ceil(0.5 * len(image) / per_px) + 2
    pairs = [_lattice(image, per_px, way, reach) for way in ways]
    return [(read, read + share * (exact - read)) for read, exact in pairs] if share < 1.0 else pairs


def _lattice(image: np.ndarray, per_px: int, way: Way, reach: int) -> Lattice:
    """`lattices` of one path. image: of the aperture, on parts of pixels. reach: room for it, with the samples around it."""
    x, y, shares = _centred(way)
    own = math.ceil(float(np.abs([x, y]).max())) + 1
    pixels = np.arange(-own, own + 1)
    read = (_tents(y[:, None] - pixels) * shares[:, None]).T @ _tents(x[:, None] - pixels)

    def means(parts: np.ndarray) -> np.ndarray:
        return (_tent_means(y[:, None] - parts, per_px) * shares[:, None]).T @ _tent_means(x[:, None] - parts, per_px)

    if len(image) < per_px:  # few of the parts lie within the image of a pixel
        around, half = np.arange(-own - 1, own + 2), len(image) // 2
        near = means((around[:, None] - np.arange(-half, half + 1) / per_px).reshape(-1))
        each = near.reshape(len(around), len(image), len(around), len(image))
        seen = np.tensordot(each, image, ((1, 3), (0, 1)))
    else:
        spread = np.pad(convolve(means(np.arange(-own * per_px, own * per_px + 1) / per_px), image), per_px)
        past = (len(spread) // 2) % per_px  # it ends anywhere beyond the last pixel
        seen = spread[past : len(spread) - past : per_px, past : len(spread) - past : per_px]
    most = own + reach + 1
    return np.pad(read, most - own), np.pad(seen, most - len(seen) // 2)


def _centred(way: Way) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places x, y of a path, less whole pixels by which all of it lies aside, and their shares."""
    x, y, shares = np.array(way).T
    return x - round(float(x.mean())), y - round(float(y.mean())), shares


def convolve(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Convolution (n + m - 1, n + m - 1) of arrays (n, n) and (m, m), by Fourier transforms."""
    size = len(one) + len(other) - 1
    step = 1 << max(size.bit_length() - 4, 0)
    shape = (-(-size // step) * step,) * 2  # without large prime factors
    found = np.fft.irfft2(np.fft.rfft2(one, shape) * np.fft.rfft2(other, shape), shape)
    return np.asarray(found[:size, :size])


def pixels_of(weights: np.ndarray, read: np.ndarray) -> np.ndarray:
    """Weights of pixels (n, n), of samples with these weights that have weights `read` (n, n) of pixels each."""
    first = len(weights) // 2
    return convolve(read, weights)[first : first + len(read), first : first + len(read)]


def skewed_pixels(weights: np.ndarray, way: Way, skew_px: tuple[float, float], half: int) -> np.ndarray:
    """`pixels_of` samples whose rows are swept at times of their own, each by a way x, y after the one above it.

    skew_px: that way [pixels]. half: pixels to either side of the middle that are looked at. Returns (2 half + 1, ...).
    """
    (x, y, shares), pixels = _centred(way), np.arange(-half, half + 1)
    reach, size = len(weights) // 2, 2 * half + len(weights)
    found = np.zeros((2 * half + 1, 2 * half + 1))
    for row, own in enumerate(weights, -reach):
        down = _tents(row + y[:, None] + row * skew_px[1] - pixels)
        read = (down * shares[:, None]).T @ _tents(x[:, None] + row * skew_px[0] - pixels)
        spread = np.fft.irfft(np.fft.rfft(read, size, axis=1) * np.fft.rfft(own, size), size, axis=1)
        found += spread[:, reach : reach + len(pixels)]
    return found


def fit_weights(image: np.ndarray, pairs: Sequence[Lattice], path: ReadPath) -> np.ndarray:
    """Weights of samples that come nearest to exact ones of pixels: (n, n) float64, sum 1.

    image: weights of samples that are even squares. pairs: of `lattices`.
    """
    image = np.pad(image, path.beside)
    even = _shrunk(image >= (1.0 - EVEN) * image.max(), path.inside)
    own = _grown(image > EVEN * image.max(), path.beside) & ~even
    system, wanted, counts = _normal_equations(own, even, pairs)
    found = _with_sum(system, wanted, counts)
    if path.is_positive:  # what would be negative has none, one after the other
        kept = np.ones(len(found), bool)
        while found.min() < 0.0:
            kept &= found > 0.0
            found = np.zeros(len(kept))
            found[kept] = _with_sum(system[np.ix_(kept, kept)], wanted[kept], counts[kept])
    weights = np.zeros_like(image)
    weights[own] = found[: np.count_nonzero(own)]
    weights[even] = found[-1]
    return weights


def _normal_equations(own: np.ndarray, even: np.ndarray, pairs: Sequence[Lattice]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrix, right side and samples of each unknown, of the mean square over all pairs: own samples, then the even ones.

    own, even: masks (n, n) of samples with a weight of their own, and of those with one in common.
    """
    size = len(own)
    products, seen = np.zeros((2, 2 * size - 1, 2 * size - 1))
    for read, exact in pairs:
        middle = len(read) - 1
        around = slice(middle - size + 1, middle + size)
        products += convolve(read, read[::-1, ::-1])[around, around] / len(pairs)
        seen += convolve(exact, read[::-1, ::-1])[around, around] / len(pairs)
    (rows, columns), inside = np.nonzero(own), np.argwhere(even)
    system = products[size - 1 + rows[:, None] - rows, size - 1 + columns[:, None] - columns]
    first = size - 1 - size // 2
    wanted, counts = seen[first + rows, first + columns], np.ones(len(rows))
    if len(inside):
        places = zip(rows.tolist(), columns.tolist(), strict=True)
        mixed = [products[size - 1 + row - inside[:, 0], size - 1 + column - inside[:, 1]].sum() for row, column in places]
        pairs_apart = convolve(even.astype(float), even[::-1, ::-1].astype(float))
        together = float((pairs_apart * products).sum())
        system = np.block([[system, np.array(mixed)[:, None]], [np.array(mixed), together]])
        wanted = np.append(wanted, seen[first + inside[:, 0], first + inside[:, 1]].sum())
        counts = np.append(counts, len(inside))
    return system + SMALL**2 * np.diag(counts), wanted, counts


def _with_sum(system: np.ndarray, wanted: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Solution of normal equations under the condition that its values, counted so often, have the sum 1."""
    bordered = np.block([[system, counts[:, None]], [counts, 0.0]])
    return np.asarray(np.linalg.solve(bordered, np.append(wanted, 1.0))[:-1])


def _shrunk(mask: np.ndarray, rings: int) -> np.ndarray:
    """Mask without the elements that lie within so many steps across or down of its border."""
    for _ in range(min(rings, len(mask))):
        padded = np.pad(mask, 1)
        mask = mask & padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return mask


def _grown(mask: np.ndarray, rings: int) -> np.ndarray:
    """Mask with so many rings around it, corners included."""
    for _ in range(rings):
        padded = np.pad(mask, 1)
        rows = padded[:-2] | padded[1:-1] | padded[2:]
        mask = rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:]
    return mask


def _sharpened(image: np.ndarray) -> np.ndarray:
    return convolve(image, np.outer(SHARPER, SHARPER))


def _tents(away_px: np.ndarray) -> np.ndarray:
    """Share of a pixel so far away in light that is linear between pixels."""
    return np.maximum(1.0 - np.abs(away_px), 0.0)


def _tent_means(away_px: np.ndarray, per_px: int) -> np.ndarray:
    """Mean of `_tents` over parts of a pixel, of which there are so many along an axis."""
    ends = [np.clip(away_px + end / per_px, -1.0, 1.0) for end in (-0.5, 0.5)]
    before, after = (end - 0.5 * end * np.abs(end) for end in ends)
    return per_px * (after - before)
