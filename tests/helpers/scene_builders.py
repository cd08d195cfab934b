"""Scenes from arrays."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simulator.scene.scene import Scene


class FixedScene:
    """A scene that is already there."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def load(self) -> Scene:
        return self.scene


def band_scene(planes: ArrayLike, depth_m: float | np.ndarray = 2.0, **settings: Any) -> FixedScene:
    """Planes (height, width[, bands]); each band is equal-energy light over a third of 400-700 nm, or all of it.

    Three bands are dark at 500 and 600 nm, as the colours of `small_camera` are blind there: each reaches one colour alone.
    """
    planes = np.asarray(planes, dtype=np.float32)
    planes = planes[..., None] if planes.ndim == 2 else planes
    wavelengths = np.arange(400.0, 701.0, 10.0)
    inner = np.linspace(400.0, 700.0, planes.shape[2] + 1)[1:-1]
    edges = [0.0, *inner, np.inf]
    spectra = np.stack([(wavelengths > low) & (wavelengths < high) for low, high in zip(edges[:-1], edges[1:], strict=True)])
    return FixedScene(Scene(planes, 1e-3 * spectra, wavelengths, np.ones(31), depth_m=depth_m, **settings))


def distances(width: int, height: int, angle_deg: float) -> np.ndarray:
    """Distance of every photosite's centre from an edge through the middle [px]."""
    angle = math.radians(angle_deg)
    y, x = np.mgrid[:height, :width]
    return (x - 0.5 * width + 0.3) * math.cos(angle) + (y - 0.5 * height) * math.sin(angle)


def scene_edge(angle_deg: float, per_photosite: int = 8, width: int = 96, height: int = 128) -> np.ndarray:
    """Fine scene grid of a sharp edge: the share of every scene pixel that is bright."""
    parts = 4
    distance = distances(width * per_photosite * parts, height * per_photosite * parts, angle_deg)
    fine = (distance > 0).astype(np.float32)
    shape = (height * per_photosite, parts, width * per_photosite, parts)
    return 0.2 + 0.8 * fine.reshape(shape).mean(axis=(1, 3))
