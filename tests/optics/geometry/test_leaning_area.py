"""Means of even squares over photosites that lean in the scene, against float64 polygons that are clipped at each pixel."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.polygon_means import polygon_mean

from simulator.device import open_device
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import Projection, project, project_planes
from simulator.optics.lens.distortion import Distortion, plan_warp
from simulator.sensor.camera.camera import Window
from simulator.sensor.camera.cfa import Cfa

SENSOR = 4000, 3000  # so large that photosites are parallelograms, whose sides do not bend
WINDOW = Window(3901, 2907, 37, 24)  # near a corner
WARP = plan_warp(Distortion(k1=-0.06, p1=0.004, unit="half_diagonal"), 1e4, *SENSOR, 1)


def turned_pose(angle_rad, zoom=1.0):
    """Pose of a camera that is turned around a place in the window, and its homography of places from there."""
    turn = zoom * np.array([[np.cos(angle_rad), -np.sin(angle_rad)], [np.sin(angle_rad), np.cos(angle_rad)]])
    numbers = (3920.25, 2918.5, 0.31, *(turn[0] - (1.0, 0.0)), -0.17, *(turn[1] - (0.0, 1.0)), 0.0, 0.0)
    return tuple(map(float, numbers)), turn


def seen_corners(projection, turn, x, y, side):
    """Corners (4, 2) of a square around places x, y on the sensor [photosites], as the scene has them [px]."""
    corners = np.array([x, y]) + 0.5 * side * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    if projection.warp is not None:
        corners = np.stack(projection.warp.undistorted(*corners.T, 0), axis=1)
    if projection.pose is not None:
        pivot = np.array(projection.pose[:2])
        corners = pivot + (corners - pivot) @ turn.T + (projection.pose[2], projection.pose[5])
    return np.array([projection.offset_x, projection.offset_y]) + projection.scale * corners


def leaning_projection(scale, warp, angle_rad):
    """Projection of a small scene that the window sees, and the turn of its pose."""
    pose, turn = (None, np.eye(2)) if angle_rad is None else turned_pose(angle_rad)
    extent = 2.0 if angle_rad is not None else warp.extent(*SENSOR)[3]
    whole = Projection(scale, 0.0, 0.0, 130, 110, 1, True, warp=warp, pose=pose, stretch=1.1, extent=extent)
    middle = seen_corners(whole, turn, WINDOW.x + 18.5, WINDOW.y + 12.0, 0.0)[0]
    return replace(whole, offset_x=float(60.3 - middle[0]), offset_y=float(50.7 - middle[1])), turn


@pytest.mark.parametrize(
    ("scale", "warp", "angle_rad"),
    [(0.6, WARP, None), (1.02, WARP, None), (2.3, WARP, None), (7.0, WARP, None), (2.3, WARP, 0.4), (1.0, None, 0.003)]
    + [(1.7, None, angle_rad) for angle_rad in (1e-6, 0.3, 0.25 * np.pi, 0.5 * np.pi, 2.0, -3.0)],
)
@pytest.mark.parametrize("open_side", [1.0, 0.6])
def test_photosites_that_lean_are_exact_means(scale, warp, angle_rad, open_side):
    """A lens that distorts, and turns by any angle; what is left of the former is how much the sides of photosites bend."""
    device, squares = open_device(), (np.random.default_rng(2).random((110, 130)) < 0.5).astype(np.float32)
    projection, turn = leaning_projection(scale, warp, angle_rad)
    projection = replace(projection, open_side=open_side)
    assert projection.has_leaning(1)
    lit = project(device, projection, Cfa.uniform(0), WINDOW, device.upload(squares[None]))
    light = device.download(lit, (WINDOW.height, WINDOW.width), np.float32)
    for row, column in np.random.default_rng(3).integers([0, 0], [WINDOW.height, WINDOW.width], (30, 2)):
        corners = seen_corners(projection, turn, WINDOW.x + column + 0.5, WINDOW.y + row + 0.5, open_side)
        assert light[row, column] == pytest.approx(polygon_mean(squares, corners), abs=4e-6 if warp is None else 1.2e-4)


def test_samples_of_leaning_photosites_are_exact_means():
    """Two samples per photosite and axis are parallelograms; four are taken for upright, as they are blurred."""
    device, squares = open_device(), (np.random.default_rng(2).random((110, 130)) < 0.5).astype(np.float32)
    projection, turn = leaning_projection(2.3, WARP, None)
    assert projection.has_leaning(2) and not projection.has_leaning(4)
    layout = InterleavedColumns(2, 20, 16)
    sampled = device.empty(layout.shape(1), np.float32)
    project_planes(device, projection, device.upload(squares[None]), 1, sampled, 0, layout, (WINDOW.x, WINDOW.y))
    found = layout.decode(device.download(sampled, layout.shape(1), np.float32))[0]
    for y, x in [(3, 5), (12, 1), (19, 30), (8, 17), (0, 0)]:
        corners = seen_corners(projection, turn, WINDOW.x + (x + 0.5) / 2.0, WINDOW.y + (y + 0.5) / 2.0, 0.5)
        assert found[y, x] == pytest.approx(polygon_mean(squares, corners), abs=1.2e-4)


def test_photosites_far_beyond_a_sensor_keep_all_light():
    """There a barrel distortion folds, and some are seen as wide as a thousand: blur reads them beside the sensor."""
    device, warp = open_device(), plan_warp(Distortion(k1=-0.12, unit="half_diagonal"), 1e4, 300, 200, 1)
    stretch, extent = warp.extent(300, 200)[2:]
    projection = Projection(1.5, 0.0, 0.0, 450, 300, 2, False, warp=warp, stretch=stretch, extent=extent)
    window = Window(-300, -300, 900, 800)
    lit = project(device, projection, Cfa.uniform(0), window, device.upload(np.ones((1, 300, 450), np.float32)))
    assert np.abs(device.download(lit, (800, 900), np.float32) - 1.0).max() < 1e-5


def test_a_lamp_lights_only_photosites_that_see_it():
    """A lamp of 10^8: photosites are right to a few of their 23 bits, and what does not reach its pixel is black."""
    device, squares = open_device(), np.zeros((110, 130), np.float32)
    squares[51, 61] = 1e8
    for warp, angle_rad in ((WARP, None), (None, 0.3), (WARP, 2.0)):
        projection, turn = leaning_projection(1.7, warp, angle_rad)
        lit = project(device, projection, Cfa.uniform(0), WINDOW, device.upload(squares[None]))
        light = device.download(lit, (WINDOW.height, WINDOW.width), np.float32)
        places = np.indices(light.shape).reshape(2, -1).T + (WINDOW.y + 0.5, WINDOW.x + 0.5)
        seen = [seen_corners(projection, turn, x, y, 1.0) for y, x in places]
        reaches = [(one.max(axis=0) > (61, 51)).all() and (one.min(axis=0) < (62, 52)).all() for one in seen]
        truth = [polygon_mean(squares, one) if reached else 0.0 for one, reached in zip(seen, reaches, strict=True)]
        assert np.abs(light.ravel() - truth).max() < 6e3 and light.sum() == pytest.approx(np.sum(truth), rel=1e-4)
        assert not light.ravel()[~np.array(reaches)].any()
