"""Independent truth: mean electrons of shots that are simple enough for closed forms, or sums ray by ray, in float64 NumPy.

Every photosite's light is the mean over its open area, the pupil and the exposure time of what a straight line meets, layer by
layer. One set of Sobol' points serves all photosites; sets that are scrambled independently tell the standard error.
"""

import math
from dataclasses import dataclass

import numpy as np
from helpers.area_truth import photosite_means
from scipy.stats import qmc

from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan
from simulator.pipeline.scene_loading import load_scene
from simulator.pipeline.shot import Shot

SETS, POINTS = 8, 8192


@dataclass(frozen=True)
class Truth:
    """Mean electrons (height, width) float64 and their standard error."""

    electrons: np.ndarray
    error: np.ndarray


def is_simple(shot: Shot, planned: Plan) -> bool:
    """Whether this module knows all of the shot: a scene of even squares, surfaces at one distance each, a round ideal lens.

    Layers may move evenly along straight lines; the camera stands. A low-pass filter makes four spots.
    """
    optics, lens = planned.optics, shot.lens
    scene = load_scene(shot.scene)
    if not isinstance(lens, ThinLens) or not optics.projection.is_fine or scene.deep is not None:
        return False
    plain_lens = lens.aperture is None and lens.vignetting is None and lens.distortion is None and lens.psf is None
    plain_lens &= not lens.has_diffraction and lens.veiling_glare == 0.0
    flat = all(np.ndim(layer.depth_m) == 0 and layer.depth_m is not None for layer in scene.layers)
    motion, exposure = shot.motion, shot.exposure
    still = motion is None or (
        motion.camera is None and motion.vectors is None and all(_is_straight(one) for one in motion.layers.values())
    )
    return plain_lens and flat and still and exposure.flash is None and exposure.flicker is None


def _is_straight(move: object) -> bool:
    """Whether a layer moves with one velocity in pixels per second."""
    velocity = getattr(move, "velocity", None)
    return (
        getattr(move, "spin_deg_per_s", 0.0) == 0.0
        and getattr(move, "path", None) is None
        and velocity is not None
        and all(speed.unit == "px/s" for speed in velocity)
    )


def exact_means(shot: Shot, planned: Plan) -> Truth | None:
    """Mean electrons of one surface at rest with whole scene pixels in each photosite, by the areas of chords of the aperture.

    None where a shot that `is_simple` has more than that.
    """
    scene, projection, camera = load_scene(shot.scene), planned.optics.projection, shot.camera
    scale, window = round(projection.scale), planned.optics.window
    is_whole = abs(projection.scale - scale) < 1e-9 and projection.offset_x == projection.offset_y == 0.0
    if scene.behind or shot.motion is not None or camera.low_pass_um > 0.0 or not is_whole:
        return None
    assert isinstance(shot.lens, ThinLens) and isinstance(scene.depth_m, float | int)
    radius_px = _radius_px(shot.lens, camera.pixel_pitch_um, float(scene.depth_m))
    margin = math.ceil(abs(radius_px)) + 1
    light = scene.planes.astype(np.float64) @ planned.optics.weights.astype(np.float64)
    light = np.pad(light, ((margin * scale, margin * scale), (margin * scale, margin * scale), (0, 0)), "edge")
    shape = light.shape[0] // scale, light.shape[1] // scale
    means = [photosite_means(light[..., one], shape, abs(radius_px), camera.fill_factor) for one in range(light.shape[2])]
    inside = np.stack(means)[:, margin + window.y :, margin + window.x :][:, : window.height, : window.width]
    found = np.take_along_axis(inside, _channels(planned)[None], axis=0)[0] * _electrons_per_radiance(shot, planned)
    return Truth(found, np.zeros_like(found))


def _channels(planned: Plan) -> np.ndarray:
    """Colour plane of each photosite of the window (height, width)."""
    window, block = planned.optics.window, np.array(planned.optics.cfa.block(planned.optics.window.x, planned.optics.window.y))
    y, x = np.mgrid[: window.height, : window.width]
    return block[y % 2, x % 2]


def sum_rays(shot: Shot, planned: Plan, sets: int = SETS, points: int = POINTS) -> Truth:
    """Mean electrons of a shot that `is_simple`."""
    found = np.stack([_one_set(shot, planned, seed, points) for seed in range(sets)])
    return Truth(found.mean(axis=0), found.std(axis=0, ddof=1) / math.sqrt(sets))


def _one_set(shot: Shot, planned: Plan, seed: int, points: int) -> np.ndarray:
    optics, lens, camera = planned.optics, shot.lens, shot.camera
    assert isinstance(lens, ThinLens)
    scale, window = optics.projection.scale, optics.window
    rows, columns = window.height, window.width
    y, x = window.y + np.arange(rows) + 0.5, window.x + np.arange(columns) + 0.5
    channels, layers = _channels(planned), []
    for layer in load_scene(shot.scene).layers:
        planes = layer.planes.astype(np.float64) @ optics.weights.astype(np.float64)
        coverage = None if layer.coverage is None else layer.coverage.astype(np.float64)
        layers.append(
            (planes, coverage, _radius_px(lens, camera.pixel_pitch_um, float(layer.depth_m)), _speed(shot, len(layers)))
        )
    side = math.sqrt(camera.fill_factor)
    per_row_s = _seconds_per_row(shot, camera.height_px)
    spot_px = 0.5 * camera.low_pass_um / camera.pixel_pitch_um  # from the middle of the four to each, on either axis
    draws = qmc.Sobol(7, seed=1000 + seed).random(points)
    total = np.zeros((rows, columns))
    for across, down, share, angle, instant, left_or_right, up_or_down in draws:
        right_px = side * (across - 0.5) + math.copysign(spot_px, left_or_right - 0.5)
        down_px = side * (down - 0.5) + math.copysign(spot_px, up_or_down - 0.5)
        u = math.sqrt(share) * np.array([math.cos(2 * math.pi * angle), math.sin(2 * math.pi * angle)])
        time_s = instant * shot.exposure.time_s + per_row_s * (y - 0.5)
        light, through = np.zeros((rows, columns)), np.ones((rows, columns))
        for planes, coverage, radius, (right, below) in layers:
            at_x = optics.projection.offset_x + scale * (x + right_px + radius * u[0]) - right * time_s[:, None]
            at_y = optics.projection.offset_y + scale * (y + down_px + radius * u[1]) - below * time_s
            column = np.clip(np.floor(at_x).astype(int), 0, planes.shape[1] - 1)
            row = np.clip(np.floor(at_y).astype(int), 0, planes.shape[0] - 1)[:, None]
            light += through * planes[row, column, channels]
            if coverage is None:
                break
            through = through * (1.0 - coverage[row, column])
        total += light
    return total / points * _electrons_per_radiance(shot, planned)


def _radius_px(lens: ThinLens, pitch_um: float, depth_m: float) -> float:
    """Signed blur radius [photosites]: half of f^2 / N (1/z_focus - 1/z) v / f, positive behind the focus."""
    image_mm = 1.0 / (1.0 / lens.focal_length_mm - 1e-3 / lens.focus_distance_m)
    inverse_mm = 1e-3 * (1.0 / lens.focus_distance_m - 1.0 / depth_m)
    return 0.5 * lens.focal_length_mm / lens.f_number * image_mm * inverse_mm * 1e3 / pitch_um


def _speed(shot: Shot, number: int) -> tuple[float, float]:
    """Speed of a layer, to the right and down [scene pixels/s]."""
    move = None if shot.motion is None else shot.motion.layers.get(number)
    if move is None or move.velocity is None:
        return 0.0, 0.0
    return move.velocity[0].value, move.velocity[1].value


def _seconds_per_row(shot: Shot, rows: int) -> float:
    """Time from the opening of a row to that of the next [s]."""
    shutter = shot.exposure.shutter
    readout_s = getattr(shutter, "readout_time_s", None) if shutter is not None else shot.camera.readout_time_s
    return 0.0 if readout_s is None or shot.motion is None else float(readout_s) / rows


def _electrons_per_radiance(shot: Shot, planned: Plan) -> np.ndarray:
    """Electrons per electron radiance of each photosite: that on the axis times cos^4 of the field angle."""
    lens, camera, window = shot.lens, shot.camera, planned.optics.window
    on_axis = lens.irradiance_per_radiance_sr() * shot.exposure.time_s * camera.pixel_pitch_um**2 * camera.fill_factor
    y, x = np.mgrid[: window.height, : window.width] + 0.5
    dx, dy = x + window.x - 0.5 * camera.width_px, y + window.y - 0.5 * camera.height_px
    tangent2 = (1e-3 * camera.pixel_pitch_um / lens.image_distance_mm) ** 2 * (dx**2 + dy**2)
    return on_axis * (1.0 + tangent2) ** (-2.0 if lens.cos4 else 0.0)
