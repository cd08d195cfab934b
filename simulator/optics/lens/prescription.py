"""Lens prescriptions (Zemax .zmx, Optiland .json, CODE V .seq) as our own lens objects, by tracing rays with Optiland.

Optiland (MIT licence, Kramer Harrison 2024) is an extra: it reads the file, knows the glass and traces single rays. What
becomes of the rays is computed here:

- The sensor stands where the file has the image, moved by the paraxial shift of the image from the file's object to the
  distance in focus: a lens that is focused as a whole.
- Distortion: height of the chief ray on the sensor against z_i tan(angle), at 550 nm, fitted by Brown's k1 to k3.
- Fall-off: a plane of even radiance sends flux in proportion to cos^4 of the angle at the entrance pupil through it, less the
  rays that apertures of the file stop; the area that chief rays spread it over turns it into irradiance (conservation of
  flux). It holds cos^4, vignetting and distortion, for the entrance pupil of the axis. Fitted by even powers.
- Wavefront: W whose rays land at -2 N grad W, as `Aberrations` has it, is fitted to where the traced rays land, against the
  chief ray of 550 nm at the same field. So spots are those of the rays at each field and wavelength; lateral colour is a tilt
  in it. Diffraction takes the round pupil of the axis.
"""

import importlib
import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from simulator.errors import PhotositeError, check_file, reading, require
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.falloff import Falloff
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.lens.wavefront_table import WavefrontTable, power_pairs

KEY = "lens.prescription"
ORDER = 10  # of the wavefront
DIGITS = 5  # of its coefficients in micrometres, which a frame's file holds
FIELDS = 11  # from the axis to the sensor's corner
WAVELENGTHS_NM = (400.0, 450.0, 500.0, 550.0, 600.0, 650.0, 700.0)
REFERENCE_NM = 550.0  # of distortion and fall-off
RINGS, SPOKES = 10, 24  # rays of a wavefront's fit
GRID = 129  # rays across the pupil for the fall-off
REACH = 1.05  # of the half diagonal, out to which chief rays are traced
LOADERS = {".zmx": "load_zemax_file", ".seq": "load_codev_file", ".json": "load_optiland_file"}


@dataclass(frozen=True)
class TracedLens:
    """A prescription as a thin lens with what its rays tell.

    fit_um: largest root mean square distance between traced and fitted rays of a field and wavelength [um].
    """

    name: str
    focal_length_mm: float
    f_number: float
    distortion: Distortion
    falloff: Falloff
    aberrations: Aberrations
    fit_um: float


def trace_prescription(
    path: Path, focus_distance_m: float, half_diagonal_mm: float, f_number: float | None = None
) -> TracedLens:
    """Trace a lens for a sensor of this half diagonal [mm], focused at this distance from its principal plane [m].

    f_number: at which the fall-off holds; None: that of the file. The wavefront is always that of the whole pupil.

    Raises PhotositeError for a file that is missing, damaged or of another kind, for a lens without a focal length above 0,
    a sensor's corner that its chief rays do not reach, and where Optiland is not installed.
    """
    check_file(path, KEY)
    suffixes = ", ".join(LOADERS)
    require(path.suffix.lower() in LOADERS, KEY, path, f"no known kind of prescription; give one of {suffixes}")
    return _trace(path, path.stat().st_mtime_ns, focus_distance_m, half_diagonal_mm, f_number)


@lru_cache(maxsize=16)
def _trace(
    path: Path, _modified: int, focus_distance_m: float, half_diagonal_mm: float, at_f_number: float | None
) -> TracedLens:
    rays = _Rays(path, focus_distance_m)
    heights_mm, angles = rays.chief_heights(half_diagonal_mm)
    fields = np.linspace(0.0, 1.0, FIELDS)
    tangents = np.interp(fields * half_diagonal_mm, heights_mm, angles)
    distortion = _fit_distortion(angles * rays.image_mm / half_diagonal_mm, heights_mm / half_diagonal_mm)
    planes, fit_um = [], 0.0
    for nm in WAVELENGTHS_NM:
        terms, misses_um = rays.wavefronts_um(tangents, nm)
        planes.append(tuple(tuple(round(float(value), DIGITS) for value in row) for row in terms))
        fit_um = max(fit_um, float(misses_um.max()))
    table = WavefrontTable(ORDER, tuple(fields.tolist()), WAVELENGTHS_NM, tuple(planes))
    f_number = rays.focal_mm / rays.pupil_mm
    light = rays.passed(tangents, 1.0 if at_f_number is None else min(1.0, f_number / at_f_number))
    spread = np.gradient(angles[1:] ** 2) / np.gradient(heights_mm[1:] ** 2)  # of the plane in focus over the sensor
    light *= np.interp(fields * half_diagonal_mm, heights_mm[1:], spread)
    powers = np.stack([fields**2, fields**4, fields**6], axis=1)
    k1, k2, k3 = map(float, np.linalg.lstsq(powers, light / light[0] - 1.0, rcond=None)[0])
    return TracedLens(
        path.stem,
        rays.focal_mm,
        f_number,
        distortion,
        Falloff(k1, k2, k3),
        Aberrations(at_f_number=f_number * (1.0 - 1e-12), traced=table),
        fit_um,
    )


class _Rays:
    """A prescription in Optiland, focused. All lengths in mm, fields by the tangent of their angle at the principal plane."""

    def __init__(self, path: Path, focus_distance_m: float) -> None:
        self.path, self.lens = path, _load(path)
        with _library(path):
            paraxial = self.lens.paraxial
            self.focal_mm, self.pupil_mm = _number(paraxial.f2()), _number(paraxial.EPD())
            front_mm, entrance_mm = _number(paraxial.P1()), _number(paraxial.EPL())
            last = len(self.lens.surfaces) - 2
            thickness = [_number(self.lens.surfaces.get_thickness(index)) for index in (0, last)]
        good = 0 < self.focal_mm < math.inf and 0 < self.pupil_mm < math.inf
        require(good, KEY, path, f"has a focal length of {self.focal_mm:g} mm; give a lens that forms an image")
        stated_mm = thickness[0] + front_mm
        self.object_mm = 1e3 * focus_distance_m
        require(self.object_mm > self.focal_mm, "lens.focus_distance", f"{focus_distance_m:g} m", "is within the focal length")
        self.image_mm = self._image_mm(self.object_mm)
        self.pupil_distance_mm = self.object_mm - front_mm + entrance_mm
        with _library(path):
            self.lens.set_aperture("EPD", self.pupil_mm)
            self.lens.set_thickness(self.object_mm - front_mm, 0)
            self.lens.set_thickness(thickness[1] + self.image_mm - self._image_mm(stated_mm), last)
        # Seen from behind, where the pupil is upright or inverted: the side from which a ray of the rim comes.
        _, _, _, direction, _ = self.trace(np.zeros(2), np.zeros(2), np.array([-0.5, 0.5]), 1e-3 * REFERENCE_NM)
        self.upright = -1.0 if direction[1] > 0 else 1.0
        self.working_f_number = self.focal_mm / self.pupil_mm * self.image_mm / self.focal_mm

    def _image_mm(self, object_mm: float) -> float:
        return 1.0 / (1.0 / self.focal_mm - 1.0 / object_mm)

    def trace(
        self, tangents: np.ndarray, px: np.ndarray, py: np.ndarray, wavelength_um: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return x, y on the sensor [mm], direction cosines in x, y, and whether each ray passes; fields lie along y."""
        farthest = float(np.max(np.abs(tangents))) or 0.01
        with _library(self.path):
            fields = self.lens.fields
            fields.fields.clear()
            if math.isinf(self.object_mm):
                fields.set_type("angle")
                fields.add(y=math.degrees(math.atan(farthest)))
                share = np.arctan(tangents) / math.atan(farthest)
            else:
                fields.set_type("object_height")
                fields.add(y=-farthest * self.object_mm)
                share = tangents / farthest
            rays = self.lens.trace_generic(np.zeros_like(px), np.asarray(share, float), px, py, wavelength_um)
            x, y, along_x, along_y, light = (np.array(value, float) for value in (rays.x, rays.y, rays.L, rays.M, rays.i))
        return x, y, along_x, along_y, (light > 0) & np.isfinite(x) & np.isfinite(y)

    def chief_heights(self, half_diagonal_mm: float) -> tuple[np.ndarray, np.ndarray]:
        """Return heights of chief rays on the sensor [mm], ascending from 0, and the tangents of their angles."""
        tangents = np.linspace(0.0, 1.6 * half_diagonal_mm / self.image_mm, 81)
        zero = np.zeros_like(tangents)
        _, y, _, _, passed = self.trace(tangents, zero, zero, 1e-3 * REFERENCE_NM)
        heights = np.abs(y)
        stops = np.flatnonzero(~passed | (np.diff(heights, prepend=-1.0) <= 0))
        end = int(stops[0]) if len(stops) else len(heights)
        reach_mm = float(heights[end - 1])
        rule = f"its chief rays end {reach_mm:.4g} mm off the axis, but the sensor's corner lies {half_diagonal_mm:.4g} mm off"
        require(reach_mm >= half_diagonal_mm, KEY, self.path, f"{rule}; take a smaller sensor")
        kept = heights[:end] <= max(REACH * half_diagonal_mm, heights[heights[:end].searchsorted(half_diagonal_mm)])
        return heights[:end][kept], tangents[:end][kept]

    def wavefronts_um(self, tangents: np.ndarray, wavelength_nm: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the terms of W [um], (fields, terms), and how far fitted rays land from traced ones, rms, (fields,) [um]."""
        radius = np.sqrt((np.arange(RINGS) + 0.5) / RINGS)[:, None]
        angle = 2 * math.pi * (np.arange(SPOKES) + 0.5) / SPOKES
        px, py = (radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel()
        zero = np.zeros_like(tangents)
        _, chief, *_ = self.trace(tangents, zero, zero, 1e-3 * REFERENCE_NM)
        x, y, *_ = self._trace_fields(tangents, px, py, 1e-3 * wavelength_nm)
        outwards = -1.0 if chief[-1] < 0 else 1.0
        good = np.isfinite(x) & np.isfinite(y)
        for tangent, share in zip(tangents, good.mean(axis=1), strict=True):
            rule = f"its rays at {math.degrees(math.atan(tangent)):.3g} deg do not reach the sensor; take a smaller sensor"
            require(float(share) > 0.7, KEY, self.path, rule)
        u, v = self.upright * outwards * py, self.upright * px
        landed = 1e3 * np.concatenate([outwards * (y - chief[:, None]), x], axis=1)
        basis = -2.0 * self.working_f_number * np.concatenate(_gradients(u, v))
        found, misses_um = np.empty((len(tangents), basis.shape[1])), np.empty(len(tangents))
        for pattern in np.unique(good, axis=0):  # fields whose rays all arrive are fitted together
            fields, rows = np.flatnonzero((good == pattern).all(axis=1)), np.tile(pattern, 2)
            terms, *_ = np.linalg.lstsq(basis[rows], landed[fields][:, rows].T, rcond=None)
            found[fields] = terms.T
            misses = basis[rows] @ terms - landed[fields][:, rows].T
            misses_um[fields] = np.sqrt(2.0 * np.mean(misses**2, axis=0))
        return found, misses_um

    def passed(self, tangents: np.ndarray, pupil_share: float) -> np.ndarray:
        """Return for each field the share of the pupil's rays that pass, times cos^4 of the angle at the entrance pupil.

        pupil_share: diameter of the pupil over that of the file.
        """
        axis = (np.arange(GRID) + 0.5 - 0.5 * GRID) / (0.5 * GRID)
        px, py = (each.ravel() for each in np.meshgrid(axis, axis))
        inside = px**2 + py**2 <= 1.0
        *_, passed = self._trace_fields(tangents, pupil_share * px[inside], pupil_share * py[inside], 1e-3 * REFERENCE_NM)
        at_pupil = tangents if math.isinf(self.object_mm) else tangents * self.object_mm / self.pupil_distance_mm
        return passed.mean(axis=1) / (1.0 + at_pupil**2) ** 2

    def _trace_fields(
        self, tangents: np.ndarray, px: np.ndarray, py: np.ndarray, wavelength_um: float
    ) -> tuple[np.ndarray, ...]:
        """Return what `trace` does for the same pupil points at each field, (fields, points)."""
        count = len(tangents)
        traced = self.trace(np.repeat(tangents, len(px)), np.tile(px, count), np.tile(py, count), wavelength_um)
        return tuple(each.reshape(count, -1) for each in traced)


def _gradients(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return dW/du and dW/dv of each term of unit coefficient, (points, terms); u lies along the field."""
    r2, along, across = u**2 + v**2, [], []
    for p, q in power_pairs(ORDER):
        inner = 2.0 * p * r2 ** (p - 1) if p else np.zeros_like(u)
        along.append(inner * u * u**q + (q * r2**p * u ** (q - 1) if q else 0.0))
        across.append(inner * v * u**q)
    return np.stack(along, axis=1), np.stack(across, axis=1)


def _fit_distortion(ideal: np.ndarray, seen: np.ndarray) -> Distortion:
    """Return Brown's polynomial of heights in half diagonals."""
    powers = np.stack([ideal**3, ideal**5, ideal**7], axis=1)
    k1, k2, k3 = map(float, np.linalg.lstsq(powers, seen - ideal, rcond=None)[0])
    return Distortion(k1, k2, k3, unit="half_diagonal")


def _load(path: Path) -> Any:
    try:
        files = importlib.import_module("optiland.fileio")
    except ImportError:
        rule = "needs Optiland, which reads prescriptions and traces rays: pip install 'photosite[prescription]'"
        raise PhotositeError(rule, key=KEY, value=path) from None
    load: Callable[[str], Any] = getattr(files, LOADERS[path.suffix.lower()])
    with _library(path):
        return load(os.fspath(path))


def _library(path: Path) -> Any:
    """Turn whatever Optiland raises into a PhotositeError that names the file."""
    return reading(path, "Optiland cannot trace this lens; export it again", key=KEY)


def _number(value: Any) -> float:
    return float(np.squeeze(np.asarray(value, dtype=float)))
