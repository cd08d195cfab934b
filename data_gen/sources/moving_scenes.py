"""Scenes for pictures of things that move: a fan, a ball, a bullet, a falling drop, stars over a hill, a fine pattern.

Each is drawn as layers, front to back, with coverage that is exact to a fraction of a pixel, and written as EXR files.
"""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError
from simulator.raw.image_files import write_picture

WIDTH_PX, HEIGHT_PX = 1200, 800
Color = tuple[float, float, float]
Layers = dict[str, np.ndarray]  # name of the layer -> (height, width, 4) linear R, G, B times coverage, and coverage


def moving_scene(name: str, folder: str | os.PathLike[str]) -> list[Path]:
    """Write the layers of a scene as NAME_LAYER.exr in a folder, front to back; returns the paths.

    Raises PhotositeError for a name that is none of SCENES, and when a file cannot be written.
    """
    if name not in SCENES:
        raise PhotositeError(f"give one of {', '.join(SCENES)}", key="scene", value=name)
    paths = []
    for layer, picture in SCENES[name]().items():
        path = Path(folder) / f"{name}_{layer}.exr"
        write_picture(path, picture.astype(np.float32), ("R", "G", "B", "A"), compression="zip")
        paths.append(path)
    return paths


def _grid(width_px: int = WIDTH_PX, height_px: int = HEIGHT_PX) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the pixels' centres from the middle of the picture [px], x to the right and y upwards."""
    x = np.arange(width_px) + 0.5 - 0.5 * width_px
    y = 0.5 * height_px - (np.arange(height_px) + 0.5)
    return np.broadcast_to(x, (height_px, width_px)), np.broadcast_to(y[:, None], (height_px, width_px))


def _inside(distance_px: np.ndarray) -> np.ndarray:
    """Share of each pixel inside an outline, from the distance to it, < 0 inside: that of a straight edge through the pixel."""
    return np.clip(0.5 - distance_px, 0.0, 1.0)


def _layer(color: np.ndarray | Color, coverage: np.ndarray) -> np.ndarray:
    """Layer of a colour, (3,) or (height, width, 3), with a coverage (height, width)."""
    return np.dstack([np.asarray(color) * coverage[..., None], coverage])


def _over(front: np.ndarray, back: np.ndarray) -> np.ndarray:
    """One layer of two: Porter and Duff's over."""
    return front + (1.0 - front[..., 3:]) * back


def _ellipse(x: np.ndarray, y: np.ndarray, half_width_px: float, half_height_px: float) -> np.ndarray:
    """Distance to an ellipse [px], to first order beside its outline."""
    scaled = np.hypot(x / half_width_px, y / half_height_px)
    slope = np.hypot(x / half_width_px**2, y / half_height_px**2) / np.maximum(scaled, 1e-9)
    return (scaled - 1.0) / np.maximum(slope, 1e-9)


def _wall(cell_px: float, colors: tuple[Color, Color]) -> np.ndarray:
    """Background of even tiles in two colours, whose brightness falls towards the corners."""
    x, y = _grid()
    # A product of clipped triangle waves: tiles with edges one pixel wide.
    waves = [np.clip(2.0 * np.abs((u / cell_px) % 2.0 - 1.0) * cell_px - cell_px, -0.5, 0.5) * 2.0 for u in (x, y)]
    share = 0.5 + 0.5 * waves[0] * waves[1]
    light = 1.0 - 0.25 * (np.hypot(x, y) / np.hypot(0.5 * WIDTH_PX, 0.5 * HEIGHT_PX)) ** 2
    color = (share[..., None] * np.array(colors[0]) + (1.0 - share[..., None]) * np.array(colors[1])) * light[..., None]
    return _layer(color, np.ones_like(x))


def draw_fan() -> Layers:
    """Fan of five blades in front of a wall, its axis in the middle of the picture."""
    x, y = _grid()
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    blade = np.zeros((HEIGHT_PX, WIDTH_PX))
    sector = 2.0 * np.pi / 5.0
    # Blades are swept: their middle line turns with the radius. Each is 0.6 of its sector wide.
    turned = (angle - 0.0016 * radius + np.pi) % sector - 0.5 * sector
    across_px = radius * (np.abs(turned) - 0.3 * sector)
    blade = _inside(np.maximum(across_px, np.maximum(radius - 340.0, 60.0 - radius)))
    shade = 0.45 + 0.5 * turned / sector
    blades = _layer(np.dstack([0.16 * shade, 0.42 * shade, 0.62 * shade]), blade)
    hub = _layer((0.25, 0.25, 0.27), _inside(radius - 66.0))
    return {"blades": _over(hub, blades), "wall": _wall(80.0, ((0.62, 0.56, 0.47), (0.55, 0.49, 0.41)))}


def draw_ball() -> Layers:
    """Ball with a seam at the left, before a wall of tiles."""
    x, y = _grid()
    u, v = x + 350.0, y
    light = np.clip(0.35 + 0.65 * (1.0 - np.hypot(u + 28.0, v - 36.0) / 190.0), 0.1, 1.0)
    seam = _inside(np.abs(np.hypot(u - 110.0, v) - 105.0) - 4.0)
    color = light[..., None] * ((1.0 - seam[..., None]) * np.array([0.72, 0.80, 0.12]) + seam[..., None] * 0.85)
    return {"ball": _layer(color, _inside(np.hypot(u, v) - 110.0)), "wall": _wall(50.0, ((0.5, 0.23, 0.17), (0.58, 0.3, 0.22)))}


def draw_bullet() -> Layers:
    """Bullet in flight to the right, at the left, before a dark wall; 1 px is 0.1 mm at the bullet."""
    x, y = _grid()
    u, v = x + 300.0, y
    shank = np.maximum(np.abs(u + 55.0) - 55.0, np.abs(v) - 45.0)
    nose = np.where(u > 0.0, _ellipse(np.maximum(u, 0.0), v, 130.0, 45.0), np.inf)
    light = 0.12 + 0.88 * np.clip(1.0 - ((v - 18.0) / 32.0) ** 2, 0.0, 1.0)
    color = light[..., None] * np.array([0.72, 0.42, 0.2])
    return {"bullet": _layer(color, _inside(np.minimum(shank, nose))), "wall": _layer((0.02, 0.025, 0.04), np.ones_like(x))}


def draw_drop() -> Layers:
    """Water drop in the upper half, before a bright gradient; 1 px is 0.05 mm at the drop."""
    x, y = _grid()
    u, v = x, y - 230.0
    sky = np.clip(0.30 + 0.0008 * y, 0.05, 0.7)[..., None] * np.array([0.45, 0.72, 1.0])
    # A drop shows the scene upside down, darker towards its rim, with a highlight.
    radius = np.hypot(u, v)
    through = np.clip(0.35 - 0.004 * v, 0.03, 0.9) * np.clip(1.15 - (radius / 60.0) ** 4, 0.05, 1.0)
    glint = _inside(np.hypot(u + 20.0, v - 22.0) - 7.0)
    color = through[..., None] * np.array([0.5, 0.75, 1.0]) + glint[..., None] * 3.0
    return {"drop": _layer(color, _inside(radius - 60.0)), "sky": _layer(sky, np.ones_like(x))}


def draw_stars() -> Layers:
    """Stars above a hill; the sky turns about the pole in the middle of the picture.

    Brightness follows the count of real stars, which grows about threefold a magnitude (Allen, Astrophysical Quantities).
    """
    x, y = _grid()
    rng = np.random.default_rng(20261122)
    sky = np.broadcast_to(np.array([0.0006, 0.0009, 0.0016]), (HEIGHT_PX, WIDTH_PX, 3)).copy()
    count = 500
    places = rng.uniform(-0.5, 0.5, (count, 2)) * [WIDTH_PX, HEIGHT_PX]
    magnitudes = np.log(rng.uniform(1.0, 3.0**5, count)) / np.log(3.0)  # 0 bright to 5 faint
    tints = np.array([[1.0, 0.82, 0.66], [1.0, 0.96, 0.92], [0.78, 0.87, 1.0]])[rng.integers(3, size=count)]
    for (star_x, star_y), magnitude, tint in zip(places, magnitudes, tints, strict=True):
        column, row = int(star_x + 0.5 * WIDTH_PX), int(0.5 * HEIGHT_PX - star_y)
        sky[min(row, HEIGHT_PX - 1), min(column, WIDTH_PX - 1)] += 1.5 * 10.0 ** (-0.4 * magnitude) * tint
    ridge = -270.0 + 40.0 * np.sin(x / 190.0) + 22.0 * np.sin(x / 61.0 + 1.0) + 9.0 * np.sin(x / 23.0)
    hill = _layer((0.0003, 0.0004, 0.0004), _inside(y - ridge))
    return {"hill": hill, "sky": _layer(sky, np.ones_like(x))}


def draw_pattern() -> Layers:
    """Zone plate: rings that grow finer outwards, up to half a cycle per pixel at the right edge."""
    x, y = _grid()
    phase = np.pi * (x**2 + y**2) / (2.0 * WIDTH_PX)  # local frequency r / (2 WIDTH_PX): 1/4 cycle per px at the right edge
    return {"plate": _layer(np.repeat((0.5 + 0.45 * np.cos(phase))[..., None], 3, axis=2), np.ones_like(x))}


SCENES: dict[str, Callable[[], Layers]] = {
    "ball": draw_ball,
    "bullet": draw_bullet,
    "drop": draw_drop,
    "fan": draw_fan,
    "pattern": draw_pattern,
    "stars": draw_stars,
}
