"""Planes before Mitsuba's thin lens whose texels are whole parts of photosites: a blur can be given the very same surfaces.

Every surface only emits and the integrator stops at the first hit: photosite and lens position alone are random. Focus is a
plane; `aperture_radius` and `focus_distance` are in scene units along the axis, f_px = image distance / pixel pitch:
s = aperture_radius * f_px * (1/focus - 1/z). Mitsuba 3.9: `thinlens` weighs all lens points alike, without cos^4.
"""

import math

import numpy as np


class PlaneScene:
    """Two planes facing a lens at the origin; every blur radius in photosites.

    colours: (near, far) radiance (rows, columns) of the window with its margin, `oversampling` samples per photosite and axis.
    near_part: rows and columns (slices) of the samples where the near plane is; it covers nothing else.
    """

    FOCUS, FOCAL_PX, APERTURE = 2.0, 600.0, 0.05

    def __init__(
        self,
        colours: tuple[np.ndarray, np.ndarray],
        near_part: tuple[slice, slice],
        radii_px: tuple[float, float],
        margin: int,
        oversampling: int,
    ) -> None:
        self.colours, self.near_part, self.radii_px = colours, near_part, radii_px
        self.margin, self.oversampling = margin, oversampling

    def surfaces(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """colour, coverage and radius_px (2, rows, columns), as the reference blur takes them."""
        near = np.zeros(self.colours[0].shape)
        near[self.near_part] = 1.0
        radius = np.broadcast_to(np.array(self.radii_px)[:, None, None], (2, *near.shape))
        return np.stack([self.colours[0] * near, self.colours[1]]), np.stack([near, np.ones_like(near)]), radius

    def render(self, rays: int, seed: int) -> np.ndarray:
        """Radiance (rows, columns) of the window without its margin, so many rays per photosite."""
        import mitsuba

        mitsuba.set_variant("scalar_rgb")
        rows, columns = (size // self.oversampling - 2 * self.margin for size in self.colours[0].shape)
        film = {"type": "hdrfilm", "width": columns, "height": rows, "rfilter": {"type": "box"}}
        sensor = {
            "type": "thinlens",
            "fov": 2.0 * math.degrees(math.atan(0.5 * columns / self.FOCAL_PX)),
            "fov_axis": "x",
            "aperture_radius": self.APERTURE,
            "focus_distance": self.FOCUS,
            "near_clip": 0.01,
            "to_world": mitsuba.ScalarTransform4f().look_at([0, 0, 0], [0, 0, 1], [0, 1, 0]),
            "film": film | {"pixel_format": "luminance", "component_format": "float32"},
            "sampler": {"type": "multijitter", "sample_count": rays},
        }
        whole = (slice(0, rows * 10**6), slice(0, columns * 10**6))
        planes = {"near": self._plane(0, self.near_part), "far": self._plane(1, whole)}
        scene = mitsuba.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": 1}, "sensor": sensor, **planes})
        return np.array(mitsuba.render(scene, spp=rays, seed=seed))[..., 0]

    def _plane(self, layer: int, part: tuple[slice, slice]) -> dict[str, object]:
        """Emitting rectangle with one texel per sample."""
        import mitsuba

        rows, columns = self.colours[layer].shape
        (top, bottom, _), (left, right, _) = part[0].indices(rows), part[1].indices(columns)
        distance = 1.0 / (1.0 / self.FOCUS - self.radii_px[layer] / (self.APERTURE * self.FOCAL_PX))
        size = distance / (self.FOCAL_PX * self.oversampling)  # of a sample
        texels = np.repeat(self.colours[layer][part][::-1, :, None], 3, axis=2).astype(np.float32)  # row 0 is at the bottom
        image = {
            "type": "bitmap",
            "bitmap": mitsuba.Bitmap(texels),
            "raw": True,
            "filter_type": "nearest",
            "wrap_mode": "clamp",
        }
        place = mitsuba.ScalarTransform4f().translate(
            [-size * (0.5 * (left + right) - 0.5 * columns), -size * (0.5 * (top + bottom) - 0.5 * rows), distance]
        )
        place = place @ mitsuba.ScalarTransform4f().rotate([0, 1, 0], 180)
        place = place @ mitsuba.ScalarTransform4f().scale([0.5 * size * (right - left), 0.5 * size * (bottom - top), 1.0])
        black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
        return {"type": "rectangle", "to_world": place, "emitter": {"type": "area", "radiance": image}, "bsdf": black}
