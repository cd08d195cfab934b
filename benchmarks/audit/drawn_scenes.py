"""Scenes of random shots: pictures of light, shapes of layers and maps of blur radii, drawn from a generator."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from data_gen.sources.motorcycle import motorcycle_pair
from simulator.errors import PhotositeError
from simulator.scene.color_channels import srgb_to_linear

LIGHTS = ("flat", "gradient", "waves", "patches", "texture", "noise", "edges", "lamps", "photograph")
SURFACES = ("one", "tilted", "steps", "curved", "disks", "photograph", "layers", "tilted layers")
LEAST_PX, MOST_PX = 0.03, 12.0  # blur radii that are drawn [photosites]


@dataclass(frozen=True)
class Surface:
    """One surface of a scene.

    light: (height, width, 3) float32, linear RGB, bright parts around 1. coverage: (height, width) float32; None: everywhere.
    radius_px: signed blur radius, positive behind the focus [photosites]; a number, or a map (height, width).
    """

    light: np.ndarray
    coverage: np.ndarray | None
    radius_px: float | np.ndarray


def draw_light(rng: np.random.Generator, kind: str, shape: tuple[int, int], per_photosite: float) -> np.ndarray:
    """Return linear RGB (height, width, 3) float32 of one of LIGHTS.

    shape: height and width [scene pixels]. per_photosite: scene pixels per photosite, in whose units sizes are drawn.
    """
    height, width = shape
    y, x = (np.mgrid[:height, :width] + 0.5) / per_photosite
    tint = rng.uniform(0.3, 1.0, 3) if rng.random() < 0.7 else np.ones(3)
    dark = 10.0 ** rng.uniform(-3.0, -0.3)
    if kind == "photograph":
        return _crop(rng, shape)[0]
    if kind == "flat":
        grey = np.ones(shape)
    elif kind == "gradient":
        angle = rng.uniform(0.0, 2.0 * np.pi)
        ramp = np.cos(angle) * x + np.sin(angle) * y
        grey = dark + (1.0 - dark) * (ramp - ramp.min()) / max(float(np.ptp(ramp)), 1e-9)
    elif kind == "waves":
        angle, period = rng.uniform(0.0, 2.0 * np.pi), np.exp(rng.uniform(np.log(3.0), np.log(40.0)))
        grey = 0.5 + 0.5 * (1.0 - dark) * np.sin(2.0 * np.pi * (np.cos(angle) * x + np.sin(angle) * y) / period)
    elif kind == "patches":
        side = max(1, round(per_photosite * np.exp(rng.uniform(np.log(2.0), np.log(12.0)))))
        patches = rng.random((height // side + 1, width // side + 1, 3))
        return _float32(dark + (1.0 - dark) * np.kron(patches, np.ones((side, side, 1)))[:height, :width])
    elif kind == "texture":
        grey = np.zeros(shape)
        for size, weight in ((9.0, 0.5), (3.0, 0.3), (0.0, 0.2)):
            side = max(1, round(size * per_photosite))
            grey += (
                weight * np.kron(rng.random((height // side + 1, width // side + 1)), np.ones((side, side)))[:height, :width]
            )
        grey = dark + grey**2
    elif kind == "noise":
        return _float32(dark + (1.0 - dark) * rng.random((height, width, 3)) * tint)
    elif kind == "edges":
        grey = np.full(shape, dark)
        for _ in range(int(rng.integers(2, 12))):
            top, left = rng.integers(0, height), rng.integers(0, width)
            grey[top : top + rng.integers(2, height), left : left + rng.integers(2, width)] = rng.choice(
                [dark, rng.random(), 1.0]
            )
    else:
        return _lamps(rng, shape, dark, tint)
    return _float32(grey[..., None] * tint)


def _lamps(rng: np.random.Generator, shape: tuple[int, int], dark: float, tint: np.ndarray) -> np.ndarray:
    """One to five pixels of 100 to 10^8 over black, over an even wall, or over a texture."""
    height, width = shape
    under = rng.choice(["black", "even", "texture"])
    light = np.zeros((height, width, 3)) if under == "black" else np.ones((height, width, 3)) * tint
    if under == "texture":
        light = dark + (1.0 - dark) * rng.random((height, width, 3)) * tint
    count = int(rng.integers(1, 6))
    light[rng.integers(0, height, count), rng.integers(0, width, count)] = 10.0 ** rng.uniform(2.0, 8.0)
    return _float32(light)


def draw_surfaces(
    rng: np.random.Generator, kind: str, light: str, shape: tuple[int, int], per_photosite: float
) -> list[Surface]:
    """Return the surfaces of a scene of one of SURFACES, front to back; the last covers everything.

    light: kind of the light of the last one, of LIGHTS. shape, per_photosite: as of `draw_light`.
    """
    if kind in ("layers", "tilted layers"):
        return _layers(rng, kind, light, shape, per_photosite)
    if kind == "photograph":
        picture, inverse_depth = _crop(rng, shape)
        near, far = sorted((draw_radius(rng), draw_radius(rng)))
        return [Surface(picture, None, near + (far - near) * (1.0 - inverse_depth))]
    radius = draw_radius(rng) if kind == "one" else _map(rng, kind, shape, per_photosite)
    return [Surface(draw_light(rng, light, shape, per_photosite), None, radius)]


def draw_radius(rng: np.random.Generator) -> float:
    """Signed blur radius [photosites]: in focus, or even in its logarithm between LEAST_PX and MOST_PX."""
    if rng.random() < 0.12:
        return 0.0
    size = np.exp(rng.uniform(np.log(LEAST_PX), np.log(MOST_PX)))
    return float(size * rng.choice([-1.0, 1.0]))


def _map(rng: np.random.Generator, kind: str, shape: tuple[int, int], per_photosite: float) -> np.ndarray:
    """Blur radii of a surface (height, width) [photosites]."""
    height, width = shape
    y, x = (np.mgrid[:height, :width] + 0.5) / per_photosite
    middle = draw_radius(rng)
    angle, slope = rng.uniform(0.0, 2.0 * np.pi), 10.0 ** rng.uniform(-3.0, np.log10(0.25))
    plane = slope * (np.cos(angle) * (x - x.mean()) + np.sin(angle) * (y - y.mean()))
    if kind == "tilted":
        return middle + plane
    if kind == "curved":
        return middle + plane + slope * (x - x.mean()) * (y - y.mean()) / max(x.max(), y.max())
    if kind == "steps":
        side = max(1, round(per_photosite * rng.uniform(6.0, 24.0)))
        levels = np.array([draw_radius(rng) for _ in range(int(rng.integers(2, 5)))])
        return np.kron(rng.choice(levels, (height // side + 1, width // side + 1)), np.ones((side, side)))[:height, :width]
    found = middle + plane  # disks before a tilted wall
    for _ in range(int(rng.integers(1, 4))):
        inside = _disk(rng, x, y)
        nearer = min(draw_radius(rng), float(found.min()) - 0.05)
        found = np.where(inside, nearer, found)
    return found


def _disk(rng: np.random.Generator, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Where a disk of random place and size lies."""
    size = rng.uniform(0.1, 0.35) * min(x.max(), y.max())
    return (x - rng.uniform(0.0, x.max())) ** 2 + (y - rng.uniform(0.0, y.max())) ** 2 < size**2


def _layers(rng: np.random.Generator, kind: str, light: str, shape: tuple[int, int], per_photosite: float) -> list[Surface]:
    """Two or three layers, those in front with holes; the nearest has the least signed radius."""
    height, width = shape
    y, x = (np.mgrid[:height, :width] + 0.5) / per_photosite
    radii = np.unique([draw_radius(rng) for _ in range(int(rng.integers(2, 4)))])
    found = []
    for number, radius in enumerate(radii.tolist()):
        is_last = number == len(radii) - 1
        own = light if is_last else str(rng.choice([one for one in LIGHTS if one != "photograph"]))
        coverage = None if is_last else _shape_of_layer(rng, x, y)
        blur: float | np.ndarray = radius
        if is_last and kind == "tilted layers":
            tilt = 10.0 ** rng.uniform(-3.0, -1.0) * (x if rng.random() < 0.5 else y)
            blur = radius + tilt
        found.append(Surface(draw_light(rng, own, shape, per_photosite), coverage, blur))
    return found


def _shape_of_layer(rng: np.random.Generator, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Coverage (height, width) float32: a disk, bars, a half-plane, or a veil that is partly transparent."""
    kind = rng.choice(["disk", "bars", "half", "veil"])
    if kind == "disk":
        return _float32(_disk(rng, x, y))
    if kind == "bars":
        across = x if rng.random() < 0.5 else y
        return _float32(across % rng.uniform(6.0, 20.0) < rng.uniform(1.0, 5.0))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    side = _float32(np.cos(angle) * (x - x.mean()) + np.sin(angle) * (y - y.mean()) > 0.0)
    return side if kind == "half" else _float32(rng.uniform(0.2, 0.9) * side)


@lru_cache(maxsize=1)
def _photograph() -> tuple[np.ndarray, np.ndarray]:
    left, depth_m, _ = motorcycle_pair()
    return left, depth_m


def _crop(rng: np.random.Generator, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Light (height, width, 3) and inverse depth (height, width), 1 at the nearest, of a part of a stereo photograph.

    Where it is not installed: a texture with a step.
    """
    place = rng.random(2)
    try:
        left, depth_m = _photograph()
    except PhotositeError:
        noise = rng.random((*shape, 3))
        return _float32(0.01 + noise**2), np.repeat(np.arange(shape[1])[None, :] > shape[1] / 2, shape[0], axis=0).astype(float)
    repeats = [-(-size // there) for size, there in zip(shape, left.shape, strict=False)]
    if max(repeats) > 1:  # in mirror images
        pad = [(0, (count - 1) * there) for count, there in zip(repeats, left.shape, strict=False)]
        left, depth_m = np.pad(left, (*pad, (0, 0)), "symmetric"), np.pad(depth_m, pad, "symmetric")
    top, start = (int(share * (there - size + 1)) for share, there, size in zip(place, left.shape, shape, strict=False))
    light = srgb_to_linear(left[top : top + shape[0], start : start + shape[1]] / 255.0)
    inverse = 1.0 / depth_m[top : top + shape[0], start : start + shape[1]]
    return _float32(light), (inverse - inverse.min()) / max(float(np.ptp(inverse)), 1e-9)


def _float32(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=np.float32)
