"""Bounds of velocities, the order of surfaces, and the starts of a search, which miss no surface that passes."""

import numpy as np
import pytest
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.motion import Motion
from simulator.exposure.vector_maps import VectorMap
from simulator.optics.geometry.pixel_vectors import FARTHEST, STARTS, TILE, PixelVectors, pixel_vectors

RANDOM = np.random.default_rng(4)
SIZE = 70, 90


def field(right: float = 0.0, down: float = 0.0) -> np.ndarray:
    return np.broadcast_to(np.float32([right, down]), (*SIZE, 2)).copy()


def test_a_polygon_holds_all_velocities_closely():
    velocity = RANDOM.normal(0.0, 100.0, (300, 4, 2)).astype(np.float32)
    corners = PixelVectors(velocity, None).polygon
    angles = np.linspace(0.0, 2.0 * np.pi, 300)
    ways = np.stack([np.cos(angles), np.sin(angles)])
    held, bound = (velocity.reshape(-1, 2) @ ways).max(axis=0), (corners @ ways).max(axis=0)
    assert (held <= bound * (1.0 + 1e-6)).all()
    assert np.hypot(*corners.T).max() < 1.09 * np.hypot(velocity[..., 0], velocity[..., 1]).max()
    np.testing.assert_allclose(PixelVectors(field(100.0, -30.0), None).polygon, [[100.0, -30.0]])


def test_the_nearer_covers_and_without_depth_the_faster():
    velocity = field()
    velocity[0, 0], velocity[0, 1] = (3.0, 4.0), (0.0, -6.0)
    depth_m = np.full(SIZE, np.inf, np.float32)
    depth_m[0, 1] = 2.0
    assert PixelVectors(velocity, None).table()[0, :3, 2].tolist() == [-5.0, -6.0, 0.0]
    assert PixelVectors(velocity, depth_m).table()[0, :3, 2].tolist() == [FARTHEST, 2.0, FARTHEST]


def test_a_field_without_jumps_has_one_start():
    for velocity in (field(), field(3e4, -2e3), field(1e9, 1e9)):
        starts = PixelVectors(velocity, None).starts(0.0, 0.1)
        assert starts.shape == (5, 6, 2 * STARTS) and (starts[..., 0] == 1).all()
        assert (starts[..., 2:].reshape(5, 6, 4, 2) == velocity[0, 0]).all()


@pytest.mark.parametrize("clock_s", [(0.0, 0.1), (0.05, 0.1), (-0.1, 0.0)])
def test_starts_are_there_where_a_thing_passes(clock_s):
    """Three small things of their own ways: each tile that a thing is over at some time has a start of its velocity."""
    things = {(12, 14): (600.0, 200.0), (40, 60): (-500.0, 100.0), (60, 30): (50.0, -550.0)}
    velocity = field()
    for (row, column), speed in things.items():
        velocity[row : row + 6, column : column + 6] = speed
    starts = PixelVectors(velocity, None).starts(*clock_s)
    for (row, column), speed in things.items():
        for time_s in np.linspace(*clock_s, 30):
            x, y = column + 3 + speed[0] * time_s, row + 3 + speed[1] * time_s
            if not (0 <= x < SIZE[1] and 0 <= y < SIZE[0]):
                continue
            own = starts[int(y // TILE), int(x // TILE)]
            counted = own[2 : 2 * int(own[0])].reshape(-1, 2)  # the first one is the place itself
            assert (counted == speed).all(axis=1).any()


def test_neighbours_come_apart_when_their_ways_do():
    velocity = field()
    velocity[:, 40:] = (0.0, 10.0)
    vectors = PixelVectors(velocity, None)
    assert vectors.tears(0.0, 0.051) and vectors.tears(-0.051, 0.0) and not vectors.tears(0.0, 0.049)


def test_metres_need_a_distance(tmp_path):
    np.save(tmp_path / "flow.npy", field(1.0, 0.0))
    motion = Motion(vectors=VectorMap(tmp_path / "flow.npy", "m/s"))
    depth_m = np.full(SIZE, 4.0, np.float32)
    depth_m[0] = np.inf
    found = pixel_vectors(band_scene(np.ones(SIZE), depth_m).load(), motion, 100.0)
    assert found is not None and found.velocity[:2, 0].tolist() == [[0.0, 0.0], [25.0, 0.0]]
    assert found.depth_m is not None
    flat = pixel_vectors(band_scene(np.ones(SIZE), 2.0).load(), motion, 100.0)
    assert flat is not None and flat.depth_m is None and flat.velocity[5, 5].tolist() == [50.0, 0.0]
    with pytest.raises(PhotositeError, match="motion.vectors.unit = m/s: is in metres, but the scene has no distance; give"):
        pixel_vectors(band_scene(np.ones(SIZE), np.inf).load(), motion, 100.0)
    assert pixel_vectors(band_scene(np.ones(SIZE)).load(), Motion(), 100.0) is None


def test_searches_that_would_begin_alike_are_made_once():
    """Of a thing of one velocity before what is at rest: from the place itself, and from where the thing was."""
    velocity = np.zeros((160, 240, 2), np.float32)
    velocity[30:50, 30:50] = (300.0, -40.0)
    starts = PixelVectors(velocity, None).starts(0.0, 0.1)
    torn = starts[..., 0] > 1
    assert torn.any() and not torn.all() and (starts[torn][:, 0] == 2).all()
    assert (starts[torn][:, 2:4] == (300.0, -40.0)).all()
