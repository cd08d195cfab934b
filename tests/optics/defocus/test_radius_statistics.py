"""Radius statistics of patches against NumPy, and their merge over all patches within reach."""

import numpy as np
import pytest

from simulator.optics.defocus.defocus import (
    CLASS_UNIT_PX,
    PATCH_COLUMNS,
    PATCH_ROWS,
    TILE_COLUMNS,
    TILE_ROWS,
    RadiusStatistics,
    merge_within_reach,
)
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.passes.radius_statistics import measure_patches

ROWS, HALF = 32, 64
FIRST_CLASS, PER_UNIT = -30.0, 12.0


@pytest.fixture(scope="module")
def measured(bench):
    """A map (rows, 2 half columns) and its radius_statistics from the device."""
    rng = np.random.default_rng(5)
    picture = (rng.normal(0.0, 6.0, (ROWS, 2 * HALF)) * (rng.random((ROWS, 2 * HALF)) > 0.5)).astype(np.float32)
    maps = InterleavedColumns(1, ROWS, HALF).encode(np.stack([0.0 * picture, picture]))
    classes = {"first_class": FIRST_CLASS, "classes_per_unit": PER_UNIT}
    return picture, *measure_patches(bench.device, bench.device.upload(maps), ROWS, HALF, 1, **classes)


def patches(picture: np.ndarray) -> np.ndarray:
    """(patch rows, patch columns, values of the patch)."""
    split = picture.reshape(ROWS // PATCH_ROWS, PATCH_ROWS, -1, PATCH_COLUMNS).swapaxes(1, 2)
    return split.reshape(*split.shape[:2], -1)


def test_least_and_greatest_value_and_steepest_step(measured):
    picture, (least, greatest, steepest, *_), _ = measured
    assert np.array_equal(least, patches(picture).min(axis=2)) and np.array_equal(greatest, patches(picture).max(axis=2))
    right = np.abs(np.diff(picture, axis=1, append=picture[:, -1:]))
    down = np.abs(np.diff(picture, axis=0, append=picture[-1:]))
    assert np.array_equal(steepest, np.maximum(patches(right), patches(down)).max(axis=2))


def test_a_step_inside_the_last_patch_of_a_row_is_seen(device):
    """Between two photosites of different column sets, where no patch follows whose first photosite could be read."""
    for column in range(2 * HALF - PATCH_COLUMNS, 2 * HALF - 1):
        picture = np.where(np.arange(2 * HALF) > column, 3.0, 0.0) * np.ones((ROWS, 1), np.float32)
        maps = device.upload(InterleavedColumns(1, ROWS, HALF).encode(picture[None].astype(np.float32)))
        (_, _, steepest, *_), _ = measure_patches(
            device, maps, ROWS, HALF, 0, first_class=FIRST_CLASS, classes_per_unit=PER_UNIT
        )
        assert (steepest[:, -1] == 3.0).all(), column


def test_slopes_are_the_mean_step_inside_a_patch(measured):
    picture, (*_, slope_x, slope_y), _ = measured
    split = picture.astype(np.float64).reshape(ROWS // PATCH_ROWS, PATCH_ROWS, -1, PATCH_COLUMNS)
    assert np.allclose(slope_x, np.diff(split, axis=3).mean(axis=(1, 3)), atol=1e-5)
    assert np.allclose(slope_y, np.diff(split, axis=1).mean(axis=(1, 3)), atol=1e-5)


def test_classes_widen_with_the_value(measured):
    picture, _, found = measured
    place = PER_UNIT * np.arcsinh(patches(picture).astype(np.float64) / CLASS_UNIT_PX) - FIRST_CLASS
    whole = np.abs(place - np.rint(place)) < 1e-3  # may fall on either side
    expected = np.bitwise_or.reduce(np.uint64(1) << place.astype(np.uint64), axis=2)
    unsure = [
        np.bitwise_or.reduce(np.uint64(1) << np.where(whole, place + d, place).astype(np.uint64), axis=2) for d in (-0.5, 0.5)
    ]
    assert np.all((found == expected) | (found == unsure[0]) | (found == unsure[1]))
    assert len({int(mask).bit_count() for mask in found.ravel()}) > 1


def test_a_tile_knows_what_reaches_it_and_no_more():
    """One patch with a blur circle of 20 photosites: the tiles within 20 of it see it, whatever their own blur."""
    shape = (8 * TILE_ROWS // PATCH_ROWS, 4 * TILE_COLUMNS // PATCH_COLUMNS)
    flat = np.zeros(shape, np.float32)
    radius, classes = flat.copy(), np.ones(shape, np.uint64)
    row, columns_of_it = 7, slice(18, 20)  # photosites 56 to 63 and 144 to 159
    radius[row, columns_of_it], classes[row, columns_of_it] = -20.0, 2
    seen = merge_within_reach(
        RadiusStatistics(radius, np.maximum(radius, 0.0), flat, flat, flat, classes, flat + 1, flat + 1)
    ).of_tiles()
    rows, columns = np.arange(8) * TILE_ROWS, np.arange(4) * TILE_COLUMNS
    gap_y = np.maximum(np.maximum(56 - (rows + TILE_ROWS), rows - 64), 0)
    gap_x = np.maximum(np.maximum(144 - (columns + TILE_COLUMNS), columns - 160), 0)
    gap = np.hypot(gap_y[:, None], gap_x[None, :])
    reached = seen.classes == 3
    assert np.all(reached[gap <= 20.0]) and not reached[gap > 22.0 + np.hypot(PATCH_ROWS, PATCH_COLUMNS)].any()
    assert np.all(seen.least_px[reached] == -20.0) and np.all(seen.least_px[~reached] == 0.0)


def test_a_blur_circle_of_many_patches_is_seen_wherever_it_reaches():
    """400 photosites: all tiles within the circle see it, none outside the square around it; and the other way round."""
    shape = (64 * TILE_ROWS // PATCH_ROWS, 10 * TILE_COLUMNS // PATCH_COLUMNS)
    flat, classes = np.zeros(shape, np.float32), np.ones(shape, np.uint64)
    classes[61, 74:76] = 2  # photosites 488 to 495 and 592 to 607
    rows, columns = np.arange(64) * TILE_ROWS, np.arange(10) * TILE_COLUMNS
    gap_y = np.maximum(np.maximum(488 - (rows + TILE_ROWS), rows - 496), 0)[:, None]
    gap_x = np.maximum(np.maximum(592 - (columns + TILE_COLUMNS), columns - 608), 0)[None, :]
    for own, others in ((400.0, 0.0), (0.0, 400.0)):
        radius = np.where(classes == 2, own, others).astype(np.float32)
        seen = merge_within_reach(
            RadiusStatistics(radius, radius, flat, flat, flat, classes, flat + 1, flat + 1), largest_px=400.0
        ).of_tiles()
        reached = seen.classes == 3
        assert np.all(reached[np.hypot(gap_y, gap_x) <= 400.0])
        assert not reached[np.maximum(gap_y, gap_x) > 402.0 + PATCH_COLUMNS].any()
        assert reached.any() and not reached.all() and np.all(seen.greatest_px[reached] == 400.0)
