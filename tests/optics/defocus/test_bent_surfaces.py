"""What means miss of surfaces that bend within blur circles: nothing of planes; of waves and borders what is stated."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates, uniform_filter
from scipy.stats import qmc

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.bent_surfaces import bent_error, border_errors, crossed_error
from simulator.optics.geometry.scene_part import ScenePart
from simulator.optics.pupil.pupil import Pupil

SCALE, SIDE = 4, 24  # pixels per photosite, photosites
BRIGHT = Accuracy(electrons=1e6, read_noise_e=0.0)


def light_at(place: np.ndarray) -> np.ndarray:
    """Waves of 5 and 7 photosites; place (2, ...)."""
    return 0.5 + 0.2 * np.sin(2.0 * np.pi * place[0] / 5.0 + 1.0) + 0.2 * np.cos(2.0 * np.pi * (place[0] + place[1]) / 7.0)


def radius_at(place: np.ndarray, wave_px: float) -> np.ndarray:
    return 1.5 + 0.05 * place[1] + wave_px * np.sin(2.0 * np.pi * (place[0] + 0.5 * place[1]) / 6.0)


def means(wave_px: float, kind: str) -> np.ndarray:
    """Light of photosites (side, side) by rays that meet the surface, its tangent planes, or an upright image that is moved."""
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    draws, found = qmc.Sobol(4, seed=1).random(128), np.zeros((SIDE, SIDE))
    step = 1.0
    slope = [
        0.5 * (radius_at(np.stack([y + dy, x + dx]), wave_px) - radius_at(np.stack([y - dy, x - dx]), wave_px))
        for dy, dx in ((step, 0.0), (0.0, step))
    ]
    for down, right, *pupil in draws:
        u_x, u_y = Pupil().map_unit_square(*pupil)
        own = np.stack([y, x])
        if kind == "surface":
            own = own + np.array([down, right])[:, None, None] - 0.5
            met = own
            for _ in range(12):
                met = own + radius_at(met, wave_px) * np.array([u_y, u_x])[:, None, None]
            found += light_at(met)
            continue
        turned, size = slope[0] * u_y + slope[1] * u_x, radius_at(own, wave_px)
        size = size + slope[0] * (down - 0.5) + slope[1] * (right - 0.5)
        own = own + np.array([down, right])[:, None, None] - 0.5
        if kind == "plane":
            found += light_at(own + size / (1.0 - turned) * np.array([u_y, u_x])[:, None, None])
        else:
            found += light_at(own + size * (np.array([u_y, u_x])[:, None, None] + 0.25 * np.stack(slope)))
    return found / len(draws)


def stated(wave_px: float, *, is_moved: bool) -> np.ndarray:
    """At the photosites' middles."""
    pixels = (np.mgrid[: SIDE * SCALE, : SIDE * SCALE] + 0.5) / SCALE
    error = bent_error(light_at(pixels)[..., None], radius_at(pixels, wave_px), SCALE, BRIGHT, is_moved=is_moved)[..., 0]
    light = light_at(pixels)  # in whose noise it is
    return (error * np.sqrt(np.maximum(light, 1e-6)))[SCALE // 2 :: SCALE, SCALE // 2 :: SCALE]


@pytest.mark.parametrize(("kind", "wave_px"), [("plane", 0.1), ("moved", 0.1), ("moved", 0.0)])
def test_means_of_planes_keep_to_what_is_stated(kind: str, wave_px: float) -> None:
    inside = slice(4, -4), slice(4, -4)
    missed = np.abs(means(wave_px, kind) - means(wave_px, "surface"))[inside]
    bound = stated(wave_px, is_moved=kind == "moved")[inside]
    assert np.mean(missed <= 1.1 * bound + 1e-4) > 0.99 and missed.max() > 0.1 * bound.max()


def test_planes_bend_nowhere() -> None:
    assert stated(0.0, is_moved=False).max() < 1e-9 < 1e-3 < stated(0.0, is_moved=True).max()


def through(light: np.ndarray, radius_of, draws: np.ndarray, side: int) -> np.ndarray:
    """Light of photosites of so many even squares, through pupils of which rays find their radius at where they land."""
    last, (v, u) = np.array(light.shape)[:, None, None] - 1, Pupil().map_unit_square(*draws[:, 2:].T)[::-1]
    found = np.zeros(np.array(light.shape) // side)
    for down, right, way in zip(*draws[:, :2].T, np.stack([v, u], axis=-1), strict=True):
        own = (np.indices(found.shape) + np.array([down, right])[:, None, None]) * side
        met = own
        for _ in range(8):
            met = own + side * radius_of(met) * way[:, None, None]
        found += light[*np.clip(np.floor(met).astype(int), 0, last)]
    return found / len(draws)


@pytest.mark.parametrize(("is_moved", "side"), [(True, 3), (True, 2), (False, 3)])
def test_depths_that_leap_through_the_focus_miss_what_is_stated_of_borders(is_moved: bool, side: int) -> None:
    """Even squares behind circles of a tenth of them: on the cliffs between, rays meet a surface in focus."""
    rng, count = np.random.default_rng(4), 16 * side
    light = 0.02 + rng.integers(0, 2, (count, count))
    cells = rng.integers(0, 2, (-(-count // 5), -(-count // 5)))
    radius = 0.03 * (2.0 * np.repeat(np.repeat(cells, 5, 0), 5, 1)[:count, :count] - 1.0)
    middles = (np.indices((16, 16)) * side + side // 2).reshape(2, -1)
    draws = qmc.Sobol(4, seed=2).random(2**13)

    def of_surface(place: np.ndarray) -> np.ndarray:
        return map_coordinates(radius, place - 0.5, order=1, mode="nearest")

    slopes = []
    for way in np.eye(2, dtype=int)[..., None]:
        before, after = (np.clip(middles + sign * side * way, 0, count - 1) for sign in (-1, 1))
        slope = (radius[*after] - radius[*before]) / (after - before).sum(axis=0)
        slopes.append(0.0 if is_moved else slope.reshape(16, 16))
    own = uniform_filter(radius, 2 - side % 2, mode="nearest")[*middles].reshape(16, 16)

    def of_middles(place: np.ndarray) -> np.ndarray:
        away = place - (np.indices((16, 16)) * side + 0.5 * side)
        return own + slopes[0] * away[0] + slopes[1] * away[1]

    missed = np.abs(through(light, of_middles, draws, side) - through(light, of_surface, draws, side)).ravel()
    args = light[..., None], radius, side, BRIGHT
    beside, within = (one(*args, is_moved=is_moved)[..., 0][*middles] for one in (crossed_error, bent_error))
    noise = np.sqrt(light.reshape(16, side, 16, side).mean(axis=(1, 3)).ravel())
    assert np.quantile(np.abs(missed - beside * noise), 0.99) < 0.4 * np.quantile(missed, 0.99)
    assert np.quantile(missed, 0.99) > 1.5 * np.quantile(within * noise, 0.99)  # what bends within circles does not tell


def test_planes_that_end_with_the_scene_miss_what_is_stated_of_the_border() -> None:
    pixels, size = (np.mgrid[: SIDE * SCALE, : SIDE * SCALE] + 0.5) / SCALE, SIDE * SCALE
    light, radius = light_at(pixels), 4.0 - 0.08 * pixels[1]
    whole = ScenePart(0, 0, size, size)

    def light_of(pixel: np.ndarray) -> np.ndarray:
        return np.asarray(light[*pixel][..., None])

    stated, share = border_errors(light_of, radius, SCALE, BRIGHT, Pupil(), whole)
    # By rays through each photosite, which meet the plane, or the surface that goes on as it ends.
    draws, missed, seen = qmc.Sobol(4, seed=1).random(4096), [], []
    for x in np.arange(SIDE):
        for y in (8, 16):
            own = np.array([[y], [x]]) + draws[:, :2].T
            way = np.stack(Pupil().map_unit_square(*draws[:, 2:].T)[::-1])
            before, behind = (np.clip(x + 0.5 + away, 0.125, SIDE - 0.125) for away in (-1.0, 1.0))
            slope = -0.04 * (behind - before)
            plane = (4.0 - 0.08 * (x + 0.5) + slope * (own[1] - x - 0.5)) / (1.0 - slope * way[1])
            met = plane
            for _ in range(12):
                met = 4.0 - 0.08 * np.clip((own + met * way)[1], 0.125, SIDE - 0.125)
            ends = (np.clip(own + one * way, 0.125, SIDE - 0.125) for one in (plane, met))
            of_plane, of_surface = (light_at(end).mean() for end in ends)
            missed.append(abs(of_plane - of_surface))
            seen.append(of_surface)
    found = np.array(missed) / np.sqrt(seen)
    assert 0.25 < share < 0.6 and found.max() > 2e-3  # 2 sigma of a million electrons
    assert 0.7 * found.max() < stated.max() < 2.5 * found.max()
    flat, _ = border_errors(light_of, np.full_like(radius, 2.0), SCALE, BRIGHT, Pupil(), whole)
    assert flat.max() < 1e-12
