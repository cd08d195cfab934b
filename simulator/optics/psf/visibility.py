"""How a difference between point spread functions shows in a scene."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

TEXTURE = 3.3 * 0.29  # of the deviation of light that is even from 0 to 1, exceeded by one photosite in a thousand
DARK_SHARE, COARSE_SHARE = 0.12, 0.5  # of the allowed error
COARSE = 0.5  # scene pixels per photosite below which its light is smooth


@dataclass(frozen=True)
class Visibility:
    """How a difference of kernels shows in a scene.

    allowed: error, as a share of the brightest light. scale: scene pixels per photosite; light is smooth where they are fewer.
    peak: light of the brightest scene pixel, in units of the brightest light. electrons: of the brightest light [e-]; dark_e:
        of the darkest. read_noise_e: of a photosite [e-]. has_layers: whether edges of layers count.
    """

    allowed: float
    scale: float = 1.0
    peak: float = 1.0
    electrons: float = 2000.0
    dark_e: float = 2000.0
    read_noise_e: float = 2.0
    has_layers: bool = False

    @property
    def is_smooth(self) -> bool:
        """Whether the scene's pixels are so much wider than photosites that its light does not show ringing."""
        return self.scale < COARSE

    @property
    def allowed_dark(self) -> float:
        """Error that is allowed beside an edge, whose dark side has less noise; coarse scenes have slopes in their place."""
        return self.allowed * (COARSE_SHARE if self.is_smooth else DARK_SHARE)

    def spread(self, rest: np.ndarray) -> np.ndarray:
        """What a difference of kernels (..., size, size) makes of a single scene pixel, divided by the pixel's light; wider."""
        if self.scale >= 1.0:
            return rest  # its tent is one photosite
        tent = _tent(1.0 / self.scale)
        return _convolve(_convolve(rest, tent).swapaxes(-2, -1), tent).swapaxes(-2, -1)

    def error(self, rest: np.ndarray) -> float:
        """Error that a difference of kernels (size, size) makes, as a share of the brightest light; see `visible_error`.

        A scene pixel wider than a photosite is a tent, which is what the projection interpolates, with light of its own.
        """
        return self.shown_error(self.spread(rest))

    def shown_error(self, seen: np.ndarray) -> float:
        """Error by what a scene pixel shows of a difference of kernels (size, size), divided by the pixel's light."""
        width = 1.0 / min(self.scale, 1.0)
        bars = max(_largest_bar(seen), _largest_bar(seen.T))
        return max(
            bars, TEXTURE * width * math.sqrt(float((seen * seen).sum())), self.peak * width**2 * float(np.abs(seen).max())
        )

    def own_error(self, rest: np.ndarray, kernel: np.ndarray) -> float:
        """`error`, or if that is larger what is seen in the noise of the dark: beside a point, and in a gap between bars.

        It counts as much as one that is seen at the brightest light as clearly as it is in the noise at its own place, which
        has the darkest light and what the kernel (size, size), smaller or larger than rest, brings there.
        """
        wide = (len(rest) - len(kernel)) // 2
        kernel = np.pad(kernel, wide) if wide >= 0 else kernel[-wide:wide, -wide:wide]
        brought, wrong, width = self.spread(kernel), self.spread(rest), 1.0 / min(self.scale, 1.0)
        found = [self.error(rest), self.in_the_dark(self.peak * width**2, wrong, brought)]
        for axis, way in itertools.product((0, 1), (1, -1)):
            half = len(wrong) // 2
            line, light = (np.cumsum(one.sum(axis=axis)[::way])[:half] for one in (wrong, brought))
            found.append(self.in_the_dark(2.0, line, light))  # as much from the other side
        return max(found)

    def in_the_dark(self, light: float, wrong: np.ndarray, brought: np.ndarray) -> float:
        """Largest error in the dark, as of `own_error`, that light in units of the brightest makes; arrays are shares of it."""
        noise_e = np.sqrt(
            np.maximum(self.dark_e + light * self.electrons * np.maximum(brought, 0.0) + self.read_noise_e**2, 1.0)
        )
        at_brightest_e = math.sqrt(self.electrons + self.read_noise_e**2)
        return float((light * np.abs(wrong) * at_brightest_e / noise_e).max())


def _largest_bar(rest: np.ndarray) -> float:
    """Largest error beside a bar of light 1 of any width that runs down."""
    return float(np.ptp(np.concatenate([[0.0], np.cumsum(rest.sum(axis=0))])))


def _tent(width: float) -> np.ndarray:
    """A tent of this half width and sum 1, on photosites."""
    half = math.ceil(width) - 1
    found = 1.0 - np.abs(np.arange(-half, half + 1)) / width
    return np.asarray(found / found.sum())


def _convolve(rows: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """Rows (..., size) convolved with an odd number of taps; wider."""
    size = rows.shape[-1]
    found = np.zeros((*rows.shape[:-1], size + len(taps) - 1))
    for place, tap in enumerate(taps):
        found[..., place : place + size] += tap * rows
    return found
