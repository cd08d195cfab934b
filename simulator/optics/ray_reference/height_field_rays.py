"""The reference blur of one picture with depth: rays through a thin lens up to their first intersection with the surface.

A picture from the centre of the lens lacks the background that the rim of the lens sees behind an edge. Here the farther
surface continues with the radius and colour at which the ray last saw it. This error cannot be removed; layers
(`lens_sampling`) have none.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simulator.device import Buffer, Device
from simulator.errors import require
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.ray_reference.layered_rays import (
    CfaBlock,
    LightsLost,
    all_places,
    check_grid,
    lights_sampler,
    ray_arguments,
    ray_defines,
)
from simulator.sensor.camera.camera import Window


def sample_height_field(
    device: Device,
    colour: ArrayLike,
    radius_px: ArrayLike,
    margin_px: int,
    points: np.ndarray,
    frame: Window,
    oversampling: int = 1,
    cfa: CfaBlock | None = None,
    eyes: CatsEyes | None = None,
    places: np.ndarray | None = None,
    finer: int = 1,
    middle_px: tuple[float, float] = (0.0, 0.0),
) -> Buffer:
    """Device buffer float32, the light of a frame, (1, height, width), in each photosite's own colour, or (channels, ...).

    colour: (channels, rows, columns) radiance, means over samples. radius_px: (rows, columns) signed blur radius [photosites].
    rows, columns: (frame + 2 margin_px) * oversampling. points: of `ray_samples` or `move_rays`. cfa, eyes, places: as in
    `sample_lens`. finer: as of `ray_defines`. middle_px: of `move_rays`.
    Neighbours whose radii differ by more than 1.5 times their distance are an edge. Raises PhotositeError for NaN and infinity.
    """
    light_in, radius = np.asarray(colour, dtype=np.float32), np.asarray(radius_px, dtype=np.float32)
    require(bool(np.isfinite(light_in).all()), "surface colour", "NaN or infinite", "give a number for every sample")
    require(
        bool(np.isfinite(radius).all()),
        "surface radius",
        "NaN or infinite",
        "give a distance for every sample, inf for the sky",
    )
    one_size = light_in.ndim == 3 and light_in[0].shape == radius.shape
    require(
        one_size,
        "surface",
        f"colour {light_in.shape}, radius {radius.shape}",
        "give (channels, rows, columns), (rows, columns)",
    )
    check_grid((radius.shape[0], radius.shape[1]), frame, margin_px, oversampling)
    planes, computed = 1 if cfa is not None else light_in.shape[0], all_places(frame) if places is None else places
    light = device.empty((planes, len(computed)), np.float32)
    device.run(
        device.kernel("lens_height_field", ray_defines(oversampling, cfa, eyes, points.shape[-1], finer)),
        (len(computed), planes),
        None,
        places=device.upload(computed.astype(np.uint32)),
        colour=device.upload(light_in),
        radius=device.upload(radius),
        light=light,
        grid={"rows": light_in.shape[1], "columns": light_in.shape[2], "margin": margin_px},
        **_steps(radius, oversampling * finer),
        **ray_arguments(device, points, frame, eyes, middle_px),
    )
    return light


def _steps(radius_px: np.ndarray, per_half_px: int) -> dict[str, int]:
    """First and last step of a ray, from before the least radius to beyond the greatest."""
    steps = 2 * per_half_px  # per photosite of radius
    return {"first": math.floor(steps * float(radius_px.min())) - 1, "last": math.ceil(steps * float(radius_px.max())) + 1}


@dataclass(frozen=True)
class HeightField:
    """Rays of a frame through one picture with distances, and rays of its small lights; arguments of `sample_height_field`."""

    colour: np.ndarray
    radius_px: np.ndarray
    device: Device
    margin_px: int
    frame: Window
    oversampling: int
    cfa: CfaBlock
    eyes: CatsEyes | None
    finer: int = 1

    def sample(self, points: np.ndarray, places: np.ndarray, middle_px: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
        """Mean light of some photosites, (n,) float32. points: of `ray_samples` or `move_rays`. middle_px: of `move_rays`."""
        scene = self.colour, self.radius_px, self.margin_px
        rays = points, self.frame, self.oversampling, self.cfa, self.eyes, places, self.finer, middle_px
        light = sample_height_field(self.device, *scene, *rays)
        return self.device.download(light, places.shape, np.float32)

    def lights_lost(self, lights: np.ndarray, pupil: Pupil) -> LightsLost | None:
        """As `LayeredRays.lights_lost`."""
        rows, columns = self.radius_px.shape
        grid = {"rows": rows, "columns": columns, "margin": self.margin_px}
        scene = {"radius": self.device.upload(self.radius_px), "grid": grid, **_steps(self.radius_px, self.oversampling)}
        defines = ray_defines(self.oversampling, None, self.eyes)
        return lights_sampler(self, "lens_height_field_lights", lights, pupil, defines, scene)
