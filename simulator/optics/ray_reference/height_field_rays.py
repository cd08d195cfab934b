"""The reference blur of one picture with distances: rays through a thin lens, stopped by the first surface they meet.

A picture from the lens's centre does not hold what the rim sees behind an edge. The rule here: a hidden surface continues the
farther one as the ray last saw it. The error that this leaves cannot be removed; layers (`lens_sampling`) have none.
"""

import math

import numpy as np

from simulator.device import Device
from simulator.errors import require
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.ray_reference.layered_rays import check_grid, ray_arguments, ray_defines
from simulator.sensor.camera.camera import Window


def sample_height_field(
    device: Device,
    colour,
    radius_px,
    margin_px: int,
    points: np.ndarray,
    frame: Window,
    oversampling: int = 1,
    cfa=None,
    eyes: CatsEyes | None = None,
):
    """Device buffer float32, the frame's light: (1, height, width), each photosite's own colour; or (channels, height, width).

    colour: (channels, rows, columns) radiance, means of samples. radius_px: (rows, columns) signed blur radius [photosites].
    rows, columns: (frame + 2 margin_px) * oversampling. points: of `lens_points`. cfa, eyes: as in `sample_lens`.
    Neighbours whose radii differ by more than 1.5 times their distance are an edge. Raises PhotositeError for NaN and infinity.
    """
    colour, radius_px = np.asarray(colour, dtype=np.float32), np.asarray(radius_px, dtype=np.float32)
    require(np.isfinite(colour).all(), "surface colour", "NaN or infinite", "give a number for every sample")
    require(
        np.isfinite(radius_px).all(), "surface radius", "NaN or infinite", "give a distance for every sample, inf for the sky"
    )
    one_size = colour.ndim == 3 and colour[0].shape == radius_px.shape
    require(
        one_size,
        "surface",
        f"colour {colour.shape}, radius {radius_px.shape}",
        "give (channels, rows, columns), (rows, columns)",
    )
    check_grid(radius_px.shape, frame, margin_px, oversampling)
    steps = 2 * oversampling  # per photosite of radius
    planes = 1 if cfa is not None else colour.shape[0]
    light = device.empty((planes, frame.height, frame.width), np.float32)
    device.run(
        device.kernel("lens_height_field", ray_defines(oversampling, cfa, eyes)),
        (frame.width, frame.height, planes),
        None,
        colour=device.upload(colour),
        radius=device.upload(radius_px),
        light=light,
        grid={"rows": colour.shape[1], "columns": colour.shape[2], "margin": margin_px},
        first=math.floor(steps * float(radius_px.min())) - 1,
        last=math.ceil(steps * float(radius_px.max())) + 1,
        **ray_arguments(device, points, frame, eyes),
    )
    return light
