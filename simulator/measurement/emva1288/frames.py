"""Simulation of the frames that EMVA 1288 requires, in light of one wavelength per colour (`photosite validate emva`)."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from simulator.color.spectra import WAVELENGTHS_NM, efficiency_on
from simulator.measurement.noise_check.flat_bench import (
    NARROW_NM,
    FlatBench,
    UniformLight,
    bench_camera,
    narrow_light,
    white_light,
)
from simulator.measurement.noise_check.frames import Pair
from simulator.progress import Progress, Steps, silent
from simulator.sensor.camera.camera import Camera

EXPOSURE_TIME_S = 0.01
WINDOW_PX = (768, 512)
# Light steps as shares of saturation: 17 below 70 %, from which K is fitted, and steps of 1 % that locate saturation.
SHARES = (*np.linspace(0.04, 0.92, 23).round(4), *np.linspace(0.93, 1.06, 14).round(4))
STACK = 16  # EMVA 1288's least number of frames for DSNU and PRNU
HALF = 0.5
WHITE_SHARE = 0.4
DARK_TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the longest
DARK_ELECTRONS = 100.0  # dark electrons in the longest exposure
LONGEST_TIME_S = 3600.0


@dataclass(frozen=True)
class ColorFiles:
    """Raw files taken in light of one wavelength. photons: per photosite, of each pair."""

    wavelength_nm: float
    photons: tuple[float, ...]
    pairs: tuple[Pair, ...]
    stack: tuple[Path, ...]


@dataclass(frozen=True)
class EmvaFiles:
    """All raw files of a measurement. colors: by channel, R, G, B or MONO. dark_times_s: exposure times of dark_pairs."""

    dark_stack: tuple[Path, ...]
    colors: dict[str, ColorFiles]
    white: Pair
    white_exposure_lx_s: float
    dark_times_s: tuple[float, ...]
    dark_pairs: tuple[Pair, ...]


@dataclass(frozen=True)
class EmvaBench:
    """Benches at one ISO: one per colour channel, in light of its most sensitive wavelength, and one in daylight."""

    camera: Camera
    iso: int
    folder: Path
    device: str | None = None

    @cached_property
    def colors(self) -> dict[str, FlatBench]:
        """Benches by channel."""
        response = self.camera.response
        curves = efficiency_on(WAVELENGTHS_NM, response.wavelengths_nm, response.quantum_efficiency)
        names = "RGB" if self.camera.channels == 3 else ("MONO",)
        first_nm, last_nm = response.wavelengths_nm[0] + NARROW_NM, response.wavelengths_nm[-1] - NARROW_NM
        peaks = np.clip(WAVELENGTHS_NM[np.argmax(curves, axis=0)], first_nm, last_nm)
        return {name: self._bench(narrow_light(float(peak))) for name, peak in zip(names, peaks, strict=True)}

    @cached_property
    def white(self) -> FlatBench:
        """Bench in daylight, for ISO 12232."""
        return self._bench(white_light())

    def dark(self, exposure_time_s: float) -> FlatBench:
        """Bench for dark frames of another exposure time."""
        return self._bench(white_light(), exposure_time_s)

    def _bench(self, light: UniformLight, exposure_time_s: float = EXPOSURE_TIME_S) -> FlatBench:
        return FlatBench(bench_camera(self.camera, *WINDOW_PX), self.iso, exposure_time_s, light, self.folder, self.device)

    def wavelength_nm(self, color: str) -> float:
        """Wavelength of a colour's light [nm]."""
        light = self.colors[color].light
        return float(light.wavelengths_nm[np.argmax(light.spectrum_w_m2_sr_nm)])

    def electrons(self, color: str) -> float:
        """Mean photoelectrons of the colour's own photosites at light factor 1 [e-]."""
        return float(self.colors[color].electrons[list(self.colors).index(color)])

    def factor(self, color: str, share: float) -> float:
        """Light factor that brings the colour's own photosites to this share of saturation."""
        return share * self.colors[color].saturation_e / self.electrons(color)

    def dark_times_s(self) -> tuple[float, ...]:
        """Exposure times that measure the dark current [s]; () for a camera without dark current."""
        current = self.white.sensor.stage("dark_current")
        if current is None:
            return ()
        dark, one_second = (self.dark(time).sensor.moments(0.0).mean for time in (EXPOSURE_TIME_S, 1.0 + EXPOSURE_TIME_S))
        rate = (one_second - dark) / self.camera.iso_setting(self.iso).gain_dn_per_e
        longest = min(DARK_ELECTRONS / max(rate, 1e-12), LONGEST_TIME_S)
        return tuple(EXPOSURE_TIME_S + share * longest for share in DARK_TIMES)

    def frames(self) -> int:
        """Number of frames that are taken."""
        return STACK + len(self.colors) * (2 * len(SHARES) + STACK) + 2 + 2 * len(self.dark_times_s())


def take_emva_frames(bench: EmvaBench, first_seed: int, progress: Progress = silent) -> EmvaFiles:
    """Simulate and save all frames; their seeds count up from the first. progress: counts frames. Raises PhotositeError."""
    take = _FrameTaker(iter(range(first_seed, first_seed + bench.frames())), Steps(progress, bench.frames()))
    dark_stack = take.stack(bench.white, "dark", 0.0)
    colors = {}
    for name, one in bench.colors.items():
        factors = [bench.factor(name, share) for share in SHARES]
        pairs = tuple(take.pair(one, f"{name}_{share:06.4f}", factor) for share, factor in zip(SHARES, factors, strict=True))
        half = bench.factor(name, HALF)
        photons = tuple(one.photons * factor for factor in factors)
        stack = take.stack(one, f"{name}_half", half)
        colors[name] = ColorFiles(bench.wavelength_nm(name), photons, pairs, stack)
    factor, times = bench.white.factor_of(WHITE_SHARE), bench.dark_times_s()
    white = take.pair(bench.white, "white", factor)
    dark_pairs = tuple(take.pair(bench.dark(time), f"dark_{index}", 0.0) for index, time in enumerate(times))
    return EmvaFiles(dark_stack, colors, white, bench.white.luminous_exposure_lx_s * factor, times, dark_pairs)


@dataclass(frozen=True)
class _FrameTaker:
    """Takes frames, each with the next seed."""

    seeds: Iterator[int]
    steps: Steps

    def frame(self, bench: FlatBench, name: str, factor: float) -> Path:
        path = bench.take(f"iso{bench.iso:06d}_{name}", factor, next(self.seeds))
        self.steps.add(name)
        return path

    def pair(self, bench: FlatBench, name: str, factor: float) -> Pair:
        return self.frame(bench, f"{name}_a", factor), self.frame(bench, f"{name}_b", factor)

    def stack(self, bench: FlatBench, name: str, factor: float) -> tuple[Path, ...]:
        return tuple(self.frame(bench, f"{name}_{index:02d}", factor) for index in range(STACK))
