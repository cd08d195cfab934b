"""EMVA 1288 measurement from raw files: all colour planes of a camera, its dark current and its ISO 12232 speed."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simulator.measurement.emva1288.frames import EmvaFiles
from simulator.measurement.emva1288.plane import EmvaPlane, LightStep, measure_plane
from simulator.measurement.noise_check.frames import Pair
from simulator.measurement.statistics.dark_current import fit_slope_over_time
from simulator.measurement.statistics.interval import Interval
from simulator.measurement.statistics.photon_transfer import DarkNoise, dark_noise
from simulator.measurement.statistics.spatial_variance import Stack, stack_of
from simulator.measurement.statistics.temporal_noise import PairNoise, pair_noise
from simulator.raw.raw_reader import RawFile, read_raw_file
from simulator.sensor.iso_speed import saturation_based_speed

PHOTONS = "photons per photosite"
COLOR_OF = {"R": "R", "Gr": "G", "Gb": "G", "B": "B", "MONO": "MONO"}


@dataclass(frozen=True)
class EmvaCamera:
    """All results measured from the raw files.

    planes, wavelengths_nm, dark_stacks, light_stacks: by plane. dark_current_e_per_s: from means and from variances, by
    plane; empty without several exposure times. saturation_exposure_lx_s: H_sat of ISO 12232 for the plane that saturates
    first in daylight; nan where its light is not known. light: what `photons` of the planes count, for the figures: seconds of
    exposure where the irradiance is not known.
    """

    planes: dict[str, EmvaPlane]
    wavelengths_nm: dict[str, float]
    dark_stacks: dict[str, Stack]
    light_stacks: dict[str, Stack]
    dark_current_e_per_s: dict[str, tuple[Interval, Interval]]
    saturation_exposure_lx_s: float
    light: str = PHOTONS

    @property
    def counts_photons(self) -> bool:
        """Whether light is known in photons, so that there is a quantum efficiency."""
        return self.light == PHOTONS

    @property
    def saturation_speed(self) -> float:
        """S_sat = 78 / H_sat (ISO 12232:2019), which keeps half a stop between white of 100 % reflectance and saturation."""
        return saturation_based_speed(self.saturation_exposure_lx_s)


def measure_emva(files: EmvaFiles) -> EmvaCamera:
    """Measure every plane in light of its own colour from nothing but the raw files. Raises PhotositeError."""
    first = read_raw_file(files.dark_stack[0])
    clipped = float(np.mean(first.mosaic == 0)) > 1e-3
    names = list(first.planes())
    dark = {name: _dark(files, name, first, clipped) for name in names}
    dark_stacks = read_stacks(files.dark_stack, names)
    planes: dict[str, EmvaPlane] = {}
    light_stacks: dict[str, Stack] = {}
    for color, of_color in files.colors.items():
        own = [name for name in names if COLOR_OF[name] == color]
        light_stacks |= read_stacks(of_color.stack, own)
        noises = [_plane_noise(pair, own) for pair in of_color.pairs]
        for name in own:
            steps = [LightStep(photons, noise[name]) for photons, noise in zip(of_color.photons, noises, strict=True)]
            planes[name] = measure_plane(steps, dark[name], dark_stacks[name], light_stacks[name], clipped)
    planes = {name: planes[name] for name in names}
    return EmvaCamera(
        planes=planes,
        wavelengths_nm={name: files.colors[COLOR_OF[name]].wavelength_nm for name in names},
        dark_stacks=dark_stacks,
        light_stacks=light_stacks,
        dark_current_e_per_s=_dark_current(files, planes),
        saturation_exposure_lx_s=_saturation_exposure(files, planes),
    )


def read_stacks(paths: tuple[Path, ...], names: list[str]) -> dict[str, Stack]:
    """Sum the frames of each plane; files are read once per plane, so that one frame at a time is in memory."""
    return {name: stack_of(read_raw_file(path).planes()[name] for path in paths) for name in names}


def _plane_noise(pair: Pair, names: list[str]) -> dict[str, PairNoise]:
    first, second = (read_raw_file(path).planes() for path in pair)
    return {name: pair_noise(first[name], second[name]) for name in names}


def _dark(files: EmvaFiles, name: str, first: RawFile, clipped: bool) -> DarkNoise:
    """Dark mean and temporal variance from pairs of consecutive frames; where dark clips, the mean is the black level."""
    paths = files.dark_stack
    found = dark_noise([_plane_noise(pair, [name])[name] for pair in zip(paths[::2], paths[1::2], strict=True)])
    return DarkNoise(float(first.black_level_dn.mean()), found.variance_dn2, found.error_dn2) if clipped else found


def _dark_current(files: EmvaFiles, planes: dict[str, EmvaPlane]) -> dict[str, tuple[Interval, Interval]]:
    """Dark current mu_I as the slope of the mean, and of the variance, of dark frames over exposure time, by plane [e-/s]."""
    if not files.dark_times_s:
        return {}
    noises, times = [_plane_noise(pair, list(planes)) for pair in files.dark_pairs], np.array(files.dark_times_s)
    found = {}
    for name, plane in planes.items():
        means = np.array([noise[name].mean_dn for noise in noises]) / plane.gain.value
        variances = np.array([noise[name].variance_dn2 for noise in noises]) / plane.gain.value**2
        found[name] = fit_slope_over_time(times, means)[0], fit_slope_over_time(times, variances)[0]
    return found


def _saturation_exposure(files: EmvaFiles, planes: dict[str, EmvaPlane]) -> float:
    """H_sat [lx s]: luminous exposure of daylight at which the first plane saturates."""
    white = _plane_noise(files.white, list(planes))
    shares = [
        (white[name].mean_dn - plane.dark.mean_dn) / (plane.saturation_e * plane.gain.value) for name, plane in planes.items()
    ]
    return files.white_exposure_lx_s / max(shares)
