"""Distortion, lateral colour and fall-off of real lenses from lensfun's database, which the user has installed.

The database is not part of Photosite (CC BY-SA 3.0). Its models (lensfun manual, "Lens models"; libs/lensfun/mod-coord.cpp,
lens.cpp and mod-color.cpp say the same) and what becomes of them, with R = r / half of the calibrated sensor's shorter side:

- ptlens  Rd = Ru (a Ru^3 + b Ru^2 + c Ru + 1 - a - b - c), poly3 Rd = Ru (k1 Ru^2 + 1 - k1), poly5 Rd = Ru (1 + k1 Ru^2 + k2
  Ru^4): the place Rd in the picture of a point that a lens without distortion has at Ru. The factor of small Ru belongs to the
  focal length (lensfun: real focal length = nominal one times it), so the polynomial is taken over r = factor Ru. `Distortion`
  is fitted to it by least squares out to 1.1 half diagonals of the calibrated sensor, since it has even powers only.
- tca linear kr, kb; poly3 R' = R (b R^2 + c R + v), of red and blue against green: the magnification that fits best over the
  frame.
- vignetting pa  1 + k1 r^2 + k2 r^4 + k3 r^6 with r = 1 in the corner of the calibrated sensor: `Falloff`, with cos^4 in it.

Between calibrated focal lengths terms times focal length follow a cubic through four (Catmull and Rom), vignetting the mean
by inverse distance to the power 3.5 of focal length, aperture and distance, as lensfun does (lens.cpp).
"""

import math
import os
import sysconfig
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from simulator.errors import PhotositeError, reading, require
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.falloff import Falloff
from simulator.optics.lens.perspective import FULL_FRAME_DIAGONAL_MM

KEY = "lens.lensfun"
LARGEST_M = 1000.0  # distance at which lensfun's database has infinity
WEIGHT_POWER = 3.5
LEAST_CROP_RATIO = 0.96  # camera over calibrated sensor, as lensfun takes it
REACH = 1.1  # half diagonals of the calibrated sensor out to which distortion is fitted
INSTALL = "install the database: apt install liblensfun-data-v1, or pip install lensfunpy"


@dataclass(frozen=True)
class LensProfile:
    """What the database knows of a lens on one sensor; None for what it does not.

    model: name in the database. fit_error: largest distance between the fitted and the database's distortion within the
    calibrated sensor, over its half diagonal.
    """

    model: str
    distortion: Distortion | None
    falloff: Falloff | None
    fit_error: float = 0.0


@dataclass(frozen=True)
class _Calibration:
    """Entries of one lens element of the database. crop, aspect: of the sensor it was calibrated on."""

    model: str
    crop: float
    aspect: float
    is_rectilinear: bool
    focal_range_mm: tuple[float, float]
    entries: dict[str, list[dict[str, str]]]

    @property
    def half_diagonal_mm(self) -> float:
        return 0.5 * FULL_FRAME_DIAGONAL_MM / self.crop

    @property
    def half_side_mm(self) -> float:
        """Half of the shorter side, R = 1."""
        return self.half_diagonal_mm / math.hypot(self.aspect, 1.0)


def database_folders() -> list[Path]:
    """Return the folders that may hold the database, the user's own first."""
    data = [Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")]
    data += [Path(folder) for folder in (os.environ.get("XDG_DATA_DIRS") or "/usr/local/share:/usr/share").split(":")]
    versions = ("", "version_2", "version_1", "version_0")
    installed = [folder / "lensfun" / version for folder in (*data, Path("/var/lib/lensfun-updates")) for version in versions]
    return [*installed, Path(sysconfig.get_path("platlib")) / "lensfunpy" / "db_files"]


def lens_profile(
    name: str,
    focal_length_mm: float,
    f_number: float,
    focus_distance_m: float,
    sensor_diagonal_mm: float,
    database: Path | None = None,
) -> LensProfile:
    """Return the profile of a lens on a sensor of this diagonal [mm], in half diagonals of that sensor.

    name: of the lens as the database has it, in any language and case. database: folder or file instead of `database_folders`.
    Raises PhotositeError for a database that is not there, an unknown name (with the nearest ones), a fish-eye, a focal
    length that the lens does not have, and a sensor larger than every one the lens was calibrated on.
    """
    found = _find_lens(name, database)
    crop = FULL_FRAME_DIAGONAL_MM / sensor_diagonal_mm
    low, high = (limit(one.focal_range_mm[end] for one in found) for end, limit in ((0, min), (1, max)))
    rule = f"{found[0].model} has {low:g} mm to {high:g} mm; set lens.focal_length to one of these"
    require(0.99 * low <= focal_length_mm <= 1.01 * high, KEY, f"{name} at {focal_length_mm:g} mm", rule)
    distortion, fit_error = None, 0.0
    half_mm = 0.5 * sensor_diagonal_mm
    if (calibration := _nearest(found, "distortion", crop)) is not None:
        rule = "has the projection of a fish-eye, which the simulator does not have; give a rectilinear lens"
        require(calibration.is_rectilinear, KEY, name, rule)
        distortion, fit_error = _fit_distortion(calibration, focal_length_mm, half_mm)
    if (calibration := _nearest(found, "tca", crop)) is not None:
        lateral = _lateral(calibration, focal_length_mm)
        own = distortion or Distortion(unit="half_diagonal")
        distortion = Distortion(own.k1, own.k2, own.k3, unit=own.unit, lateral=lateral)
    falloff = None
    if (calibration := _nearest(found, "vignetting", crop)) is not None:
        k = _vignetting(calibration, focal_length_mm, f_number, min(focus_distance_m, LARGEST_M))
        ratio = half_mm / calibration.half_diagonal_mm
        k1, k2, k3 = (float(term * ratio ** (2 * power)) for power, term in enumerate(k, 1))
        falloff = Falloff(k1, k2, k3)
    return LensProfile(found[0].model, distortion, falloff, fit_error)


def _find_lens(name: str, database: Path | None) -> list[_Calibration]:
    """Return all calibrations of the lens of this name."""
    files = _database_files(name, database)
    wanted, known, found = _plain(name), set(), []
    for file in files:
        with reading(file, "it is damaged: install the database again", key=KEY):
            root = ElementTree.parse(file).getroot()
            for element in root.iter("lens"):
                names = [text for model in element.findall("model") if (text := (model.text or "").strip())]
                known.update(names[:1])
                if wanted in map(_plain, names):
                    found.append(_read_calibration(element, names[0]))
    if found:
        return found
    words = wanted.split()
    near = sorted(known, key=lambda each: (-sum(word in _plain(each) for word in words), len(each), each))[:3]
    raise PhotositeError(f"no such lens in lensfun's database; near are: {'; '.join(near)}", key=KEY, value=name)


def _database_files(name: str, database: Path | None) -> list[Path]:
    if database is not None and database.is_file():
        return [database]
    for folder in database_folders() if database is None else [database]:
        if files := sorted(folder.glob("*.xml")):
            return files
    where = "is not installed" if database is None else "has no .xml file"
    raise PhotositeError(f"lensfun's database {where}; {INSTALL}", key=KEY, value=database or name)


def _plain(name: str) -> str:
    return " ".join(name.casefold().split())


def _read_calibration(element: ElementTree.Element, model: str) -> _Calibration:
    width, _, height = (element.findtext("aspect-ratio") or "3:2").partition(":")
    entries: dict[str, list[dict[str, str]]] = {"distortion": [], "tca": [], "vignetting": []}
    for kind, listed in entries.items():
        usable = {"distortion": ("ptlens", "poly3", "poly5"), "tca": ("linear", "poly3"), "vignetting": ("pa",)}[kind]
        listed += [dict(each.attrib) for each in element.iter(kind) if each.get("model") in usable]
    focals = [float(each["focal"]) for listed in entries.values() for each in listed]
    stated = element.find("focal")
    for key in ("value", "min", "max"):
        focals += [float(stated.attrib[key])] if stated is not None and key in stated.attrib else []
    crop, aspect = float(element.findtext("cropfactor") or 1.0), float(width) / float(height or 1.0)
    projection = element.findtext("type") or "rectilinear"
    limits = (min(focals), max(focals)) if focals else (0.0, math.inf)
    return _Calibration(model, crop, max(aspect, 1 / aspect), projection == "rectilinear", limits, entries)


def _nearest(found: Iterable[_Calibration], kind: str, crop: float) -> _Calibration | None:
    """Return the calibration on the smallest sensor that is not smaller than that of this crop factor; None without entries.

    Raises PhotositeError where all are smaller.
    """
    having = [one for one in found if one.entries[kind]]
    if not having:
        return None
    fitting = [one for one in having if crop / one.crop >= LEAST_CROP_RATIO]
    if fitting:
        return max(fitting, key=lambda one: one.crop)
    least = min(one.crop for one in having)
    rule = (
        f"was calibrated on sensors of crop factor {least:g} or more only, yet the camera has {crop:.3g}; take a smaller sensor"
    )
    raise PhotositeError(rule, key=KEY, value=having[0].model)


def _terms(entry: dict[str, str], names: Sequence[str], default: float = 0.0) -> np.ndarray:
    return np.array([float(entry.get(name, default)) for name in names])


def _at_focal(
    entries: list[dict[str, str]], focal_mm: float, terms: Callable[[dict[str, str]], np.ndarray], scaled: Sequence[int]
) -> np.ndarray:
    """Return terms between calibrated focal lengths: a cubic through four, of terms times focal length where `scaled` is 1.

    Entries of another model than the first's are left out.
    """
    model = entries[0]["model"]
    by_focal = {float(each["focal"]): terms(each) for each in reversed(entries) if each["model"] == model}
    focals = np.array(sorted(by_focal))
    values = np.array([by_focal[focal] for focal in focals])
    exact = np.isclose(focals, focal_mm, rtol=1e-6)
    if exact.any():
        return values[int(exact.argmax())]
    if not focals[0] < focal_mm < focals[-1]:
        return values[0 if focal_mm <= focals[0] else -1]
    powers = np.array(scaled)
    values = values * focals[:, None] ** powers
    after = int(np.searchsorted(focals, focal_mm))
    y2, y3 = values[after - 1], values[after]
    slope2 = 0.5 * (y3 - values[after - 2]) if after > 1 else y3 - y2
    slope3 = 0.5 * (values[after + 1] - y2) if after + 1 < len(focals) else y3 - y2
    t = (focal_mm - focals[after - 1]) / (focals[after] - focals[after - 1])
    mixed = (
        (2 * t**3 - 3 * t**2 + 1) * y2 + (t**3 - 2 * t**2 + t) * slope2 + (3 * t**2 - 2 * t**3) * y3 + (t**3 - t**2) * slope3
    )
    return mixed / focal_mm**powers


def _distortion_terms(entry: dict[str, str]) -> np.ndarray:
    """Return c0 to c4 of Rd = Ru (c0 + c1 Ru + c2 Ru^2 + c3 Ru^3 + c4 Ru^4)."""
    if entry["model"] == "ptlens":
        a, b, c = _terms(entry, ("a", "b", "c"))
        return np.array([1 - a - b - c, c, b, a, 0.0])
    k1, k2 = _terms(entry, ("k1", "k2"))
    return np.array([1 - k1, 0.0, k1, 0.0, 0.0]) if entry["model"] == "poly3" else np.array([1.0, 0.0, k1, 0.0, k2])


def _fit_distortion(calibration: _Calibration, focal_mm: float, half_diagonal_mm: float) -> tuple[Distortion, float]:
    """Return distortion in these half diagonals, and the largest error of its fit over the calibrated half diagonal."""
    terms = _at_focal(calibration.entries["distortion"], focal_mm, lambda entry: _distortion_terms(entry)[1:], (1, 1, 1, 1))
    linear = calibration.entries["distortion"][0]["model"] == "poly5"
    terms = np.concatenate([[1.0 if linear else 1.0 - terms.sum()], terms])
    corner = calibration.half_diagonal_mm / calibration.half_side_mm
    undistorted = np.linspace(0.0, 3.0 * corner, 6001)
    placed = undistorted * np.polyval(terms[::-1], undistorted)
    turns = np.flatnonzero(np.diff(placed) <= 0)
    inside = np.arange(len(placed)) <= (turns[0] if len(turns) else len(placed))
    inside &= placed <= REACH * corner
    rule = "has a distortion that folds the picture over within its calibrated sensor; the database is wrong there"
    require(placed[inside].max() >= corner, KEY, calibration.model, rule)
    from_mm = calibration.half_side_mm / half_diagonal_mm
    r, seen = undistorted[inside] * terms[0] * from_mm, placed[inside] * from_mm
    powers = np.stack([r**3, r**5, r**7], axis=1)
    k, *_ = np.linalg.lstsq(powers, seen - r, rcond=None)
    miss = np.abs(powers @ k + r - seen)[placed[inside] <= corner]
    error = float(miss.max()) / (corner * from_mm)
    k1, k2, k3 = map(float, k)
    return Distortion(k1, k2, k3, unit="half_diagonal"), error


def _lateral(calibration: _Calibration, focal_mm: float) -> tuple[float, float, float]:
    """Return the magnification of red, green and blue that is nearest to the model over the calibrated sensor."""
    entries = calibration.entries["tca"]
    linear = entries[0]["model"] == "linear"

    def terms(entry: dict[str, str]) -> np.ndarray:
        found = [_terms(entry, ("kr",) if linear else ("vr",), 1.0), _terms(entry, ("kb",) if linear else ("vb",), 1.0)]
        return np.concatenate([*found, _terms(entry, ("cr", "cb", "br", "bb"))])

    vr, vb, cr, cb, br, bb = _at_focal(entries, focal_mm, terms, (0, 0, 1, 1, 1, 1))
    r = np.linspace(0.0, calibration.half_diagonal_mm / calibration.half_side_mm, 101)
    red, blue = (float(np.sum(r**3 * (b * r**2 + c * r + v)) / np.sum(r**3)) for v, c, b in ((vr, cr, br), (vb, cb, bb)))
    return red, 1.0, blue


def _vignetting(calibration: _Calibration, focal_mm: float, f_number: float, distance_m: float) -> np.ndarray:
    """Return k1, k2, k3 at these settings: the mean of all entries by inverse distance, or the entry itself."""
    low, high = calibration.focal_range_mm
    across = max(high - low, 0.0) or 1.0
    entries = calibration.entries["vignetting"]
    place = np.array([focal_mm / across, 4.0 / f_number, 0.1 / distance_m])
    places = np.array([_terms(entry, ("focal", "aperture", "distance")) for entry in entries])
    places = np.stack([places[:, 0] / across, 4.0 / places[:, 1], 0.1 / places[:, 2]], axis=1)
    terms = np.array([_terms(entry, ("k1", "k2", "k3")) for entry in entries])
    apart = np.linalg.norm(places - place, axis=1)
    if apart.min() < 1e-4:
        return terms[int(apart.argmin())]
    weights = apart**-WEIGHT_POWER
    return weights @ terms / weights.sum()
