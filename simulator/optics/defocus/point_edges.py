"""What points of aperture and time lack at edges of layers within the samples that they read: measured at some photosites."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.aperture_samples import moving_samples, sample_count
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.edge_samples import PHOTOSITES, EdgeSamples, are_cut, lacked_sigma
from simulator.optics.geometry.projection import Projection
from simulator.scene.content_keys import digest
from simulator.scene.scene import Layer

LOOKED_AT = 8192  # photosites in which edges are looked for; of fewer all
FEW_POINTS, SEEN_POINTS = 32, 256  # at most: through which edges are looked for, and what they leave is measured


@dataclass(frozen=True)
class PointEdges:
    """Photosites that see layers through points of aperture and time, of which `mixed_edges.read_whole_pixels` holds.

    layers: the nearest first, the last of which covers all. weights: (photosites down, across, bands) of scene planes in
    electron radiance, of one period of the colour filters. blur: with the motion that its points carry. sensor_px: width,
    height of the whole sensor, so that a window has the frame's bits. over: samples per photosite and axis.
    """

    layers: Sequence[Layer]
    weights: np.ndarray
    blur: Defocus
    projection: Projection
    sensor_px: tuple[int, int]
    over: int

    def key(self) -> bytes:
        """Of the ways of points at the sensor's corners and middles, by which all that moves and blurs is told apart."""
        column, row = (few.ravel() for few in np.meshgrid(*([0, size // 2, size - 1] for size in self.sensor_px)))
        return digest(self._through_points(row, column, SEEN_POINTS).ways)

    def lacked_sigma(self, accuracy: Accuracy) -> float:
        """What points lack of the covariance of layers within samples at most [standard deviations of the noise].

        They multiply the mean of what covers a sample by the mean of what is behind it. It is that of all photosites, or of
        some thousands of a large sensor; looked at are those in which few points find an edge.
        """
        rng, (width_px, height_px) = np.random.default_rng(3), self.sensor_px
        count = width_px * height_px
        row, column = np.divmod(np.arange(count) if count <= LOOKED_AT else rng.integers(count, size=LOOKED_AT), width_px)
        found = self._through_points(row, column, FEW_POINTS)
        cut = np.flatnonzero(are_cut(self.layers, found, self.projection, self.over).any(axis=1))
        kept = np.sort(rng.permutation(cut)[:PHOTOSITES])
        samples = replace(self._through_points(row[kept], column[kept], SEEN_POINTS), crossed=len(cut) / len(row))
        return lacked_sigma(self.layers, samples, self.projection, self.over, accuracy)

    def _through_points(self, row: np.ndarray, column: np.ndarray, most: int) -> EdgeSamples:
        """Return the first samples of photosites in their own colours, with a way to where each of `most` points reads."""
        blur, projection, over, layers = self.blur, self.projection, self.over, len(self.layers)
        assert blur.motion is not None  # which points carry
        count = min(int(sample_count(np.array([blur.largest_px]), blur)[0]), most)
        points = moving_samples(blur.pupil, count, over, blur.area.open_side).astype(np.float64)
        middles_px = np.column_stack([column, row]) + 0.5
        shifts = blur.motion.at(middles_px, points[:, 5])[:, :layers].astype(np.float64)
        at = np.floor(np.array([projection.offset_x, projection.offset_y]) + projection.scale * middles_px).astype(np.intp)
        radii = np.stack([_radius_at(radius, at) for radius in blur.radii_px[:layers]], axis=1)[..., None, None]
        places = points[:, 2:4] + 0.5 - 0.5 / over  # from the first sample's
        ways = radii * (points[:, :2] + shifts[..., :2]) + shifts[..., 2:] + blur.motion.rest_px[:layers, None] + places
        weights = self.weights[row % self.weights.shape[0], column % self.weights.shape[1]]
        shares, lines = np.full((1, count), 1.0 / count), np.arange(len(ways))
        return EdgeSamples(over * row, over * column, lines, np.moveaxis(ways, 1, 2), shares, weights, 1.0)


def _radius_at(radius_px: float | np.ndarray, at: np.ndarray) -> np.ndarray:
    """Signed blur radius of a layer at pixels x, y (photosites, 2); that of its edge goes on."""
    radii = np.atleast_2d(radius_px)
    column, row = (np.clip(at[:, axis], 0, size - 1) for axis, size in enumerate(radii.shape[::-1]))
    return np.asarray(radii[row, column], np.float64)
