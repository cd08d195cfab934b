"""Textured planes before one another, as true layers, and their picture behind a thin lens by rays."""

import dataclasses

import numpy as np
from scipy.ndimage import gaussian_filter

from helpers.lens_truths import Case
from simulator.device import Device
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.sensor.camera.camera import Window


def texture(rng: np.random.Generator, shape: tuple[int, int], finest_px: float) -> np.ndarray:
    """Smoothed white noise of mean 0.45 and standard deviation 0.2, at least 0.03; finest_px: sigma of the smoothing."""
    noise = gaussian_filter(rng.normal(size=shape), finest_px, mode="wrap")
    return np.maximum(0.45 + 0.2 * noise / noise.std(), 0.03)


def textured_planes(
    radii_px: tuple[float, float, float], shape: tuple[int, int] = (160, 200), finest_px: float = 3.0, margin: int = 20
) -> Case:
    """A disk before a quarter plane before a wall, nearest first, all three textured; the truth is left empty.

    radii_px: signed blur radius of each [photosites]. shape: rows and columns with the margin.
    """
    rows, columns = shape
    rng, (y, x) = np.random.default_rng(1), np.mgrid[:rows, :columns]
    disk = (x - 0.35 * columns) ** 2 + (y - 0.5 * rows) ** 2 < (0.22 * rows) ** 2
    coverage = np.stack([disk, (x > 0.55 * columns) & (y > 0.3 * rows), np.ones(shape, bool)]).astype(float)
    colour = np.stack([texture(rng, shape, finest_px) for _ in radii_px]) * coverage
    radius = np.array(radii_px)[:, None, None] * np.ones(shape)
    truth = np.zeros((rows - 2 * margin, columns - 2 * margin))
    return Case("textured planes", colour, coverage, radius, truth, margin, 1, True)


def with_truth_of_rays(case: Case, device: Device, rays: int = 1024) -> Case:
    """The case with the picture that rays through its layers give; samples are means over photosites."""
    surfaces = upload_surfaces(device, case.colour[:, None], case.coverage, case.radius_px, case.margin, case.oversampling)
    points = ray_samples(rays)
    points[..., :2] = 0.5  # the samples hold the area of the photosites
    height, width = case.truth.shape
    light = sample_lens(device, surfaces, points, Window(case.margin, case.margin, width, height), cells=False)
    return dataclasses.replace(case, truth=device.download(light, (height, width), np.float32).astype(float))


def one_picture(case: Case) -> Case:
    """The case as a pinhole shows it: one picture, with the radius of what is in front."""
    colour, radius = np.zeros(case.colour.shape[1:]), np.zeros(case.colour.shape[1:])
    share = np.ones(case.colour.shape[1:])  # of the light from behind that passes the layers so far
    for light, cover, own in zip(case.colour, case.coverage, case.radius_px, strict=True):
        colour, radius, share = colour + share * light, radius + share * cover * own, share * (1.0 - cover)
    return dataclasses.replace(case, colour=colour[None], coverage=np.ones((1, *colour.shape)), radius_px=radius[None])
