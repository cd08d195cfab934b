"""Mitsuba 3's scalar renderer: rays through its thin lens onto the very texels that the other contestants blur.

Every surface only emits and rays end at the first one: this is the least work that Mitsuba can do for such a scene. A wall
whose blur radius rises in proportion to the column is a plane; it is cut into strips, each with the texels of its columns. What
stands before it covers whole texels, and is cut into the runs of each row. A texel per photosite, averaged over the
photosite's area, is the bilinear reading at its centre.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

STRIP_COLUMNS = 2  # of the wall, whose texels are as wide as those of the middle of their strip: to 0.01 photosites


class MitsubaLens:
    """Thin lens before a window of photosites.

    pupil_radius_m, focus_distance_m: of the lens. image_distance_px: lens to sensor in photosites.
    """

    def __init__(self, pupil_radius_m: float, focus_distance_m: float, image_distance_px: float) -> None:
        self.pupil_radius_m, self.focus_distance_m, self.image_distance_px = pupil_radius_m, focus_distance_m, image_distance_px

    def renderer(
        self, colours: np.ndarray, coverage: np.ndarray, radius_px: np.ndarray, margin: int
    ) -> Callable[[int], np.ndarray]:
        """Return what renders a number of rays per photosite as (rows, columns, 3) of the window without its margin.

        colours: (near, far) radiance (rows, columns, 3). coverage: (rows, columns) of the near surface, 0 or 1.
        radius_px: (near, far) signed blur radius (rows, columns); one for all of near, by column for far.
        """
        import mitsuba

        mitsuba.set_variant("scalar_rgb")
        rows, columns = (size - 2 * margin for size in coverage.shape)
        scene = {"type": "scene", "integrator": {"type": "path", "max_depth": 1}, "sensor": self._camera(rows, columns)}
        depth = self._depth(float(radius_px[0].flat[0]))
        for number, (place, texels) in enumerate(_runs(colours[0], coverage)):
            scene[f"near_{number}"] = self._rectangle(texels, place, coverage.shape, (depth, depth))
        slope, first = radius_px[1][0, 1] - radius_px[1][0, 0], radius_px[1][0, 0]
        for left in range(0, coverage.shape[1], STRIP_COLUMNS):
            right = min(left + STRIP_COLUMNS, coverage.shape[1])
            ends = tuple(
                self._depth(first + slope * (border - 0.5)) for border in (left, right)
            )  # a sample stands in its middle
            place = (0, coverage.shape[0], left, right)
            scene[f"far_{left}"] = self._rectangle(colours[1][:, left:right], place, coverage.shape, ends)
        loaded = mitsuba.load_dict(scene)
        return lambda rays, seed=1: np.array(mitsuba.render(loaded, spp=rays, seed=seed))

    def _depth(self, radius_px: float) -> float:
        """Distance at which the lens blurs by this signed radius [m]."""
        return 1.0 / (1.0 / self.focus_distance_m - radius_px / (self.pupil_radius_m * self.image_distance_px))

    def _camera(self, rows: int, columns: int) -> dict:
        import mitsuba

        return {
            "type": "thinlens",
            "fov": 2.0 * math.degrees(math.atan(0.5 * columns / self.image_distance_px)),
            "fov_axis": "x",
            "aperture_radius": self.pupil_radius_m,
            "focus_distance": self.focus_distance_m,
            "near_clip": 0.01,
            "to_world": mitsuba.ScalarTransform4f().look_at([0, 0, 0], [0, 0, 1], [0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": columns,
                "height": rows,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": "multijitter"},
        }

    def _rectangle(
        self, texels: np.ndarray, place: tuple[int, int, int, int], shape: tuple[int, ...], depths: tuple[float, float]
    ) -> dict[str, object]:
        """Emitting rectangle at (top, bottom, left, right) texels, with the depths of its left and right edge [m]."""
        import mitsuba

        top, bottom, left, right = place
        ends = [
            np.array([-(column - 0.5 * shape[1]) / self.image_distance_px * depth, 0.0, depth])
            for column, depth in zip((left, right), depths, strict=True)
        ]  # the picture's right is -x, its lower edge -y
        middle, across = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
        per_texel = middle[2] / self.image_distance_px
        middle[1] = -per_texel * (0.5 * (top + bottom) - 0.5 * shape[0])
        matrix = np.eye(4)
        matrix[:3, 0], matrix[1, 1], matrix[:3, 2], matrix[:3, 3] = across, 0.5 * per_texel * (bottom - top), (0, 0, -1), middle
        image = {
            "type": "bitmap",
            "bitmap": mitsuba.Bitmap(np.ascontiguousarray(texels[::-1], np.float32)),  # row 0 is at the bottom
            "raw": True,
            "filter_type": "nearest",
            "wrap_mode": "clamp",
        }
        black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
        emitter = {"type": "area", "radiance": image}
        return {"type": "rectangle", "to_world": mitsuba.ScalarTransform4f(matrix), "emitter": emitter, "bsdf": black}


def _runs(colours: np.ndarray, coverage: np.ndarray) -> Iterator[tuple[tuple[int, int, int, int], np.ndarray]]:
    """Place and texels of the runs of covered texels in each row."""
    for row, covered in enumerate(coverage > 0):
        borders = np.flatnonzero(np.diff(np.concatenate([[0], covered.astype(np.int8), [0]])))
        for left, right in borders.reshape(-1, 2):
            yield (row, row + 1, int(left), int(right)), colours[row : row + 1, left:right]
