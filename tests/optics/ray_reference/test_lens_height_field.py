"""Rays through one picture with distances: exact where nothing that matters is hidden, and a stated rule where it is."""

import numpy as np
import pytest
from helpers.lens_error import statistics, z_scores
from helpers.lens_truths import COLUMNS, Case, slanted_plane, stripes, uniform_layers

from simulator.errors import PhotositeError
from simulator.optics.ray_reference.height_field_rays import sample_height_field
from simulator.optics.ray_reference.layered_rays import ray_samples
from simulator.sensor.camera.camera import Window


def seen_from_the_centre(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Colour (1, rows, columns) and radius (rows, columns) of the nearest layer in each sample; coverage is 0 or 1 here."""
    colour, radius = case.colour[-1], case.radius_px[-1]
    for layer in range(len(case.colour) - 2, -1, -1):
        covered = case.coverage[layer] == 1.0
        colour, radius = np.where(covered, case.colour[layer], colour), np.where(covered, case.radius_px[layer], radius)
    return colour[None], radius


def picture(device, colour, radius, margin, points, frame, oversampling=1, cfa=None) -> np.ndarray:
    light = sample_height_field(device, colour, radius, margin, points, frame, oversampling, cfa)
    planes = 1 if cfa else len(colour)
    return device.download(light, (planes, frame.height, frame.width), np.float32)


def errors(device, case: Case, samples: int) -> np.ndarray:
    frame = Window(0, 0, *case.truth.shape[::-1])
    light = picture(device, *seen_from_the_centre(case), case.margin, ray_samples(samples), frame, case.oversampling)
    return z_scores(light[0], case.truth, 2000.0)


@pytest.mark.parametrize(
    ("near", "far"),
    [(-5.0, 6.0), (-11.0, 0.0), (3.0, 9.0), (0.0001, 7.0)],
)
def test_an_edge_before_a_uniform_wall_is_exact(device, near, far):
    """The wall goes on behind the edge as the rule says, so the closed form of the penumbra holds on both of its sides."""
    found = statistics(errors(device, uniform_layers(near, far, 4), 4096))
    assert found.rms < 0.05 and found.p99 < 0.15 and abs(found.mean) < 0.01


@pytest.mark.parametrize("slope", [(0.05, 0.11), pytest.param((0.3, 0.1), marks=pytest.mark.slow)])
def test_a_tilted_plane_is_one_surface_without_steps(device, slope):
    """Steps of the radius from sample to sample would leave 0.03 to 0.04 standard deviations."""
    found = statistics(errors(device, slanted_plane(slope, 8), 4096))
    assert found.p99_9 < 0.02


def test_hidden_stripes_cost_only_where_they_are_hidden(device):
    """A single picture cannot know what is behind the edge: errors reach as far as the near disk does, and no farther."""
    z = errors(device, stripes(-5.1, 6.0, 12.0, 8), 4096)
    distance = np.abs(np.arange(COLUMNS) + 0.5 - COLUMNS / 2)
    assert statistics(z[:, distance > 12.0]).p99_9 < 0.1
    assert statistics(z[:, distance < 5.0]).above_1 > 0.3


def rough_scene(rng):
    """Three colours and radii from -4 to 4 with an edge at every tenth sample, around 30 x 20 photosites, margin 6."""
    return rng.random((3, 32, 42)), np.where(rng.random((32, 42)) > 0.9, -4.0, np.linspace(0.0, 4.0, 42)[None, :])


@pytest.mark.parametrize("samples", [1, 20000])
def test_a_flat_field_stays_flat(device, samples):
    _, radius = rough_scene(np.random.default_rng(3))
    points = ray_samples(samples, patterns=2)
    found = picture(device, np.full((1, 32, 42), 0.7), radius, 6, points, Window(0, 0, 10, 5))
    assert np.max(np.abs(found / 0.7 - 1.0)) < 1e-6


def test_a_crop_has_the_bits_of_the_whole_frame_and_a_mosaic_those_of_its_colours(device):
    colour, radius = rough_scene(np.random.default_rng(4))
    points = ray_samples(64)
    whole = picture(device, colour, radius, 6, points, Window(101, 57, 30, 20))
    mosaic = picture(device, colour, radius, 6, points, Window(101, 57, 30, 20), cfa=((1, 0), (2, 1)))[0]
    for y, x, plane in ((0, 0, 1), (0, 1, 0), (1, 0, 2), (1, 1, 1)):
        assert np.array_equal(mosaic[y::2, x::2], whole[plane, y::2, x::2])
    part = (slice(4, 4 + 9 + 12), slice(6, 6 + 13 + 12))  # its radii end before those of the whole
    crop = picture(device, colour[:, *part], radius[part], 6, points, Window(107, 61, 13, 9))
    assert np.array_equal(crop, whole[:, 4:13, 6:19])


@pytest.mark.parametrize(("colour", "radius", "message"), [(np.nan, 1.0, "surface colour"), (1.0, np.inf, "surface radius")])
def test_what_is_no_number_is_refused(device, colour, radius, message):
    with pytest.raises(PhotositeError, match=message):
        sample_height_field(device, np.full((1, 9, 9), colour), np.full((9, 9), radius), 2, ray_samples(4), Window(0, 0, 5, 5))


def test_a_map_of_another_size_or_without_its_margin_is_refused(device):
    frame, points = Window(0, 0, 5, 5), ray_samples(4)
    with pytest.raises(PhotositeError, match="surface = colour"):
        sample_height_field(device, np.ones((1, 9, 9)), np.ones((9, 8)), 2, points, frame)
    with pytest.raises(PhotositeError, match="the frame and its margin"):
        sample_height_field(device, np.ones((1, 9, 9)), np.ones((9, 9)), 3, points, frame)
