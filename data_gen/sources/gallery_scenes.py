"""Scenes of the gallery (docs/gallery.md): a yard with pictures on boards, lamps in the dark, a print, and the Motorcycle.

The yard is seen from any distance in true perspective, so that a dolly zoom is one. Its pictures and textures are those that
come with scikit-image. A topic is a shot of configs/shots with the files its scene consists of.
"""

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scipy import ndimage

from data_gen.sources.motorcycle import motorcycle_scene
from data_gen.sources.moving_scenes import SCENES, moving_scene
from simulator.config.document_merge import named_file
from simulator.errors import PhotositeError
from simulator.raw.image_files import write_picture
from simulator.scene.color_channels import srgb_to_linear

WIDTH_PX = 1200  # pictures are 3 : 2
SAMPLES = 2  # along and across a pixel
SENSOR_WIDTH_MM = 35.6  # Sony A7S II
DISTANCE_PER_FOCAL_LENGTH = 64.0  # magnification 1 / 63 for each focal length
EYE_M = 1.3  # height of the lens above the ground
WALL_M, WALL_HEIGHT_M = 12.0, 4.2  # behind the subject
BALL_RADIUS_M = 0.16
LAMPS_HEIGHT_PX = 210
LAMP_DISTANCES_M = (0.5, 0.7, 1.0, 1.5, 2.5, 5.0, 20.0)


@dataclass(frozen=True)
class Board:
    """Print that faces the camera on a post. behind_m: from the subject. x_m, y_m: of its middle, y above the ground."""

    picture: str
    behind_m: float
    x_m: float
    y_m: float
    width_m: float
    height_m: float


BOARDS = {
    "subject": Board("astronaut", 0.0, 0.0, 1.3, 0.8, 0.8),
    "cat": Board("chelsea", 2.0, 1.3, 1.05, 0.9, 0.6),
    "cup": Board("coffee", 5.0, -1.9, 1.5, 1.2, 0.8),
}


def draw_yard(focal_length_mm: float, *, ball: bool = False, width_px: int = WIDTH_PX) -> dict[str, np.ndarray]:
    """Return the layers of the yard, front to back, each (height, width, 5): R, G, B times coverage, coverage, depth [m].

    The subject is 64 focal lengths away. The pictures are as wide as what a 35.6 mm wide sensor sees with it in focus: half
    angle atan(17.8 mm / z_i), z_i = f z_o / (z_o - f). ball: a ball to the left of the subject as the foremost layer.
    Raises PhotositeError when scikit-image is missing.
    """
    distance_m = 1e-3 * DISTANCE_PER_FOCAL_LENGTH * focal_length_mm
    image_mm = focal_length_mm * DISTANCE_PER_FOCAL_LENGTH / (DISTANCE_PER_FOCAL_LENGTH - 1.0)
    x, y = _rays(0.5 * SENSOR_WIDTH_MM / image_mm, width_px)
    layers = {"ball": _ball(x * distance_m, y * distance_m, distance_m)} if ball else {}
    for name, board in BOARDS.items():
        depth_m = distance_m + board.behind_m
        layers[name] = _board(board, x * depth_m, y * depth_m + EYE_M, depth_m)
    layers["wall"] = _ground_and_wall(x, y, distance_m)
    return layers


def draw_lamps() -> dict[str, np.ndarray]:
    """Return a layer for each of seven small lamps side by side, near to far, and darkness behind them, as `draw_yard` does."""
    layers = {}
    row, column = np.mgrid[:LAMPS_HEIGHT_PX, :WIDTH_PX] + 0.5
    for number, depth_m in enumerate(LAMP_DISTANCES_M):
        middle_px = WIDTH_PX * (number + 0.5) / len(LAMP_DISTANCES_M)
        coverage = np.clip(3.0 - np.hypot(column - middle_px, row - 0.5 * LAMPS_HEIGHT_PX), 0.0, 1.0)
        layers[f"lamp{number}"] = np.dstack(
            [coverage[..., None] * [1.0, 0.75, 0.45], coverage, np.full_like(coverage, depth_m)]
        )
    dark = np.zeros(row.shape)
    layers["dark"] = np.dstack([dark, dark, dark, dark + 1.0, dark + 20.0])
    return layers


def write_yard(name: str, folder: Path, focal_length_mm: float, *, ball: bool = False) -> list[Path]:
    """Write the layers of the yard as NAME_LAYER.exr; returns the paths."""
    return _write(name, folder, draw_yard(focal_length_mm, ball=ball))


def write_lamps(folder: Path) -> list[Path]:
    """Write the lamps as lamps_LAYER.exr; returns the paths."""
    return _write("lamps", folder, draw_lamps())


def write_print(folder: Path) -> list[Path]:
    """Write the astronaut as print.exr, linear; returns the path in a list."""
    path = folder / "print.exr"
    write_picture(
        path, np.ascontiguousarray(_picture("astronaut")[:342]).astype(np.float32), ("R", "G", "B"), compression="zip"
    )
    return [path]


def write_motorcycle(folder: Path) -> list[Path]:
    """Write motorcycle.exr; returns the path in a list."""
    return [motorcycle_scene(folder / "motorcycle.exr")]


def _dolly(folder: Path) -> list[Path]:
    return [path for focal in (24, 50, 135) for path in write_yard(f"yard_{focal}", folder, focal)]


TOPICS: dict[str, Callable[[Path], list[Path]]] = {
    "bare_sensor_pinhole_lens": write_motorcycle,
    "dolly_zoom": _dolly,
    "aperture_series": partial(write_yard, "yard_50", focal_length_mm=50.0),
    "shutter_series": write_motorcycle,
    "iso_series": write_motorcycle,
    "equal_exposure": partial(write_yard, "yard_ball", focal_length_mm=50.0, ball=True),
    "flash": write_motorcycle,
    "small_sensor": partial(write_yard, "yard_50", focal_length_mm=50.0),
    "spherical_aberration": write_print,
    "circle_of_confusion": write_lamps,
    "depth_of_field": write_motorcycle,
    **{name: partial(moving_scene, name) for name in SCENES},
}


def write_topic(name: str, folder: str | os.PathLike[str]) -> Path:
    """Write the scene of a topic and a copy of its shot file into a folder, made when it is missing; returns the shot file.

    Raises PhotositeError for a name that is none of TOPICS, when scikit-image is missing, or when a file cannot be written.
    """
    if name not in TOPICS:
        raise PhotositeError(f"give one of {', '.join(TOPICS)}", key="topic", value=name)
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
        TOPICS[name](place)
        return Path(shutil.copyfile(named_file("shots", name), place / f"{name}.yaml"))
    except OSError as error:
        raise PhotositeError(f"cannot be written: {error.strerror}", file=place) from error


def _write(name: str, folder: Path, layers: dict[str, np.ndarray]) -> list[Path]:
    paths = []
    for layer, picture in layers.items():
        path = folder / f"{name}_{layer}.exr"
        write_picture(path, picture.astype(np.float32), ("R", "G", "B", "A", "Z"), compression="zip")
        paths.append(path)
    return paths


def _picture(name: str) -> np.ndarray:
    """Picture of scikit-image, linear, (height, width, 3)."""
    try:
        from skimage import data

        codes = getattr(data, name)()
    except (ImportError, OSError) as error:
        raise PhotositeError(
            f"the scene needs scikit-image and its pictures ({error}): pip install 'photosite[demo]'"
        ) from error
    return srgb_to_linear((codes if codes.ndim == 3 else np.dstack([codes] * 3)) / 255.0)


def _rays(half_tangent: float, width_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Tangents of the rays through SAMPLES x SAMPLES points of each pixel, x to the right and y upwards."""
    columns, rows = width_px * SAMPLES, width_px * 2 // 3 * SAMPLES
    x = ((np.arange(columns) + 0.5) / columns - 0.5) * 2.0 * half_tangent
    y = (0.5 * rows - np.arange(rows) - 0.5) / columns * 2.0 * half_tangent
    return np.broadcast_to(x, (rows, columns)), np.broadcast_to(y[:, None], (rows, columns))


def _mean(samples: np.ndarray) -> np.ndarray:
    """Mean over the samples of each pixel."""
    rows, columns = samples.shape[:2]
    return samples.reshape(rows // SAMPLES, SAMPLES, columns // SAMPLES, SAMPLES, *samples.shape[2:]).mean(axis=(1, 3))


def _layer(color: np.ndarray, inside: np.ndarray, depth_m: float) -> np.ndarray:
    """Layer of samples at one depth. color: (rows, columns, 3); inside: (rows, columns), 0 or 1."""
    coverage = _mean(inside.astype(float))
    return np.dstack([_mean(color * inside[..., None]), coverage, np.full_like(coverage, depth_m)])


def _board(board: Board, x: np.ndarray, y: np.ndarray, depth_m: float) -> np.ndarray:
    picture = _picture(board.picture)
    u, v = (x - board.x_m) / board.width_m + 0.5, 0.5 - (y - board.y_m) / board.height_m
    height, width = picture.shape[:2]
    # The picture is cut to the board's shape, in its middle.
    scale = min(width / board.width_m, height / board.height_m)
    row, column = (v - 0.5) * board.height_m * scale + 0.5 * height - 0.5, (u - 0.5) * board.width_m * scale + 0.5 * width - 0.5
    color = np.dstack(
        [ndimage.map_coordinates(plane, [row, column], order=1, mode="nearest") for plane in np.moveaxis(picture, 2, 0)]
    )
    on_print = (np.abs(u - 0.5) < 0.5) & (np.abs(v - 0.5) < 0.5)
    rim_m = np.maximum(np.abs(x - board.x_m) - 0.5 * board.width_m, np.abs(y - board.y_m) - 0.5 * board.height_m)
    post = (np.abs(x - board.x_m) < 0.04) & (y < board.y_m) & (y > 0.0)
    color = np.where(on_print[..., None], color, [0.16, 0.10, 0.06])
    return _layer(color, (rim_m < 0.03) | post, depth_m)


def _ball(x: np.ndarray, y: np.ndarray, depth_m: float) -> np.ndarray:
    u, v = (x + 0.75) / BALL_RADIUS_M, (y + 0.25) / BALL_RADIUS_M
    light = 0.15 + 0.75 * np.clip(1.0 - 0.6 * np.hypot(u + 0.35, v - 0.4), 0.0, 1.0)
    stripe = (np.abs(v) < 0.2)[..., None]
    color = light[..., None] * np.where(stripe, [0.9, 0.9, 0.9], [0.85, 0.12, 0.08])
    return _layer(color, np.hypot(u, v) < 1.0, depth_m)


def _ground_and_wall(x: np.ndarray, y: np.ndarray, distance_m: float) -> np.ndarray:
    """Gravel up to a brick wall with lamps along its top, and the sky above it."""
    wall_m = distance_m + WALL_M
    ground_m = np.where(y < 0.0, EYE_M / np.maximum(-y, 1e-9), np.inf)
    on_ground = ground_m < wall_m
    depth_m = np.where(on_ground, ground_m, wall_m)
    across_m, above_m = x * depth_m, y * depth_m + EYE_M
    along_m = np.where(on_ground, depth_m - distance_m, 0.0)
    gravel = _tiled(_picture("gravel")[..., 0], along_m, across_m, 1.2, depth_m * depth_m / EYE_M * abs(y[1, 0] - y[0, 0]))
    bricks = _bricks(across_m, above_m)
    color = np.where(on_ground[..., None], gravel[..., None] * [1.25, 1.1, 0.9], bricks)
    sky = ~on_ground & (above_m > WALL_HEIGHT_M)
    color = np.where(sky[..., None], np.array([0.32, 0.52, 0.85]), color)
    to_lamp_m = np.hypot((across_m + 0.5) % 1.0 - 0.5, above_m - 3.0)
    color = np.where(((to_lamp_m < 0.035) & ~on_ground)[..., None], [14.0, 10.0, 6.0], color)
    mean_depth_m = 1.0 / _mean(1.0 / depth_m)
    return np.dstack([_mean(color), np.ones_like(mean_depth_m), mean_depth_m])


def _tiled(texture: np.ndarray, down_m: np.ndarray, across_m: np.ndarray, size_m: float, footprint_m: np.ndarray) -> np.ndarray:
    """Texture repeated every size_m, which fades to its mean where a sample is wider than its grain."""
    scale = texture.shape[0] / size_m
    found = ndimage.map_coordinates(texture, [down_m * scale, across_m * scale], order=1, mode="grid-wrap")
    seen = 1.0 / (1.0 + (footprint_m / (0.02 * size_m)) ** 2)
    return texture.mean() + (found - texture.mean()) * seen


def _bricks(x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
    """Running bond of bricks of 0.5 m x 0.16 m, each of a tint of its own, with joints of 2 cm."""
    row = np.floor(y_m / 0.16)
    column = np.floor(x_m / 0.5 + 0.5 * (row % 2.0))
    joint = (y_m % 0.16 < 0.02) | ((x_m + 0.25 * (row % 2.0)) % 0.5 < 0.02)
    tint = 0.75 + 0.5 * ((np.sin(row * 12.9898 + column * 78.233) * 43758.5453) % 1.0)
    return np.where(joint[..., None], [0.42, 0.40, 0.37], tint[..., None] * [0.36, 0.16, 0.11])
