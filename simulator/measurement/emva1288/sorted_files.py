"""EMVA 1288 from a bench's own raw files, sorted by their metadata: dark frames and flats of several exposure times."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.color.spectra import photons_per_joule
from simulator.errors import PhotositeError
from simulator.measurement.calibration.dark_measurement import select_plane
from simulator.measurement.calibration.frame_sorting import Frame, IsoFrames
from simulator.measurement.calibration.iso_measurement import read_codes
from simulator.measurement.emva1288.files_to_planes import PHOTONS, EmvaCamera
from simulator.measurement.emva1288.frames import STACK
from simulator.measurement.emva1288.plane import EmvaPlane, LightStep, measure_nonuniformity, measure_plane
from simulator.measurement.statistics.high_pass import high_pass
from simulator.measurement.statistics.photon_transfer import DarkNoise, dark_noise
from simulator.measurement.statistics.spatial_variance import Stack, stack_of
from simulator.measurement.statistics.temporal_noise import PairNoise, pair_noise
from simulator.progress import Progress, Steps, silent
from simulator.raw.raw_reader import plane_places

SECONDS = "exposure time [s]"
LEAST_STEPS = 5  # of light; EMVA 1288 asks for 50
UNEVEN = 1.2  # times the PRNU behind the high pass, above which light counts as uneven
HALF = 0.5  # of saturation, about where the stack for the PRNU lies


@dataclass(frozen=True)
class KnownLight:
    """Light on the sensor: irradiance [W/m^2], wavelength [nm] and distance of the photosites [um]."""

    irradiance_w_m2: float
    wavelength_nm: float
    pitch_um: float

    @property
    def photons_per_s(self) -> float:
        """Photons per second on the whole area of a photosite: E A lambda / (h c) (EMVA 1288 R4.0 Linear, eq. 3)."""
        area_m2 = (1e-6 * self.pitch_um) ** 2
        return self.irradiance_w_m2 * area_m2 * float(photons_per_joule(np.array([self.wavelength_nm]))[0])


def missing_for_emva(frames: IsoFrames) -> list[str]:
    """Return what an ISO lacks for EMVA 1288, each with what to give; an empty list where nothing is missing."""
    found, pairs = [], frames.flat_pairs
    if len(frames.short_darks) < 2:
        found.append(f"two dark frames of one exposure time or more, 16 are good (there: {len(frames.short_darks)})")
    times = {pair[0].time_s for pair in pairs}
    if len(times) < LEAST_STEPS:
        rule = (
            f"pairs of flats at {LEAST_STEPS} exposure times or more, from 5 % of saturation to beyond it (there: {len(times)})"
        )
        found.append(rule)
    if 0.0 in times:
        found.append("flats whose files tell the exposure time (EXIF)")
    if pairs and not any(frame.clips for pair in pairs for frame in pair):
        found.append("pairs of flats that are saturated, at two or more exposure times beyond the first that is")
    return found


def measure_emva_files(
    frames: IsoFrames, light: KnownLight | None, progress: Progress = silent, has_high_pass: bool = False
) -> tuple[EmvaCamera, list[str]]:
    """Measure every colour plane of one ISO, the middle of its frames; returns notes, too.

    A plane that cannot be measured is left out with a note.
    light: of the flats; None: the exposure time stands for the photons, so that there is no quantum efficiency.
    Dark frames are those of the shortest exposure time that has two; all flats of the time whose mean is next to half of
    saturation are the stack for the PRNU. has_high_pass: whether DSNU and PRNU are those behind `high_pass`.
    Raises PhotositeError, which lists all that is missing.
    """
    missing = missing_for_emva(frames)
    if missing:
        raise PhotositeError("EMVA 1288 needs more:\n  " + "\n  ".join(missing), part=f"ISO {frames.iso}")
    places = plane_places(frames.short_darks[0].cfa)
    names = list(places)
    steps = Steps(progress, 2 * len(frames.flat_pairs) + 2 * len(frames.short_darks))

    def planes_of(frame: Frame) -> dict[str, np.ndarray]:
        codes = read_codes(frame)
        steps.add(f"reading {frame.path}")
        return {name: select_plane(codes, name, places) for name in names}

    def noise_of(pair: tuple[Frame, Frame]) -> dict[str, PairNoise]:
        first, second = planes_of(pair[0]), planes_of(pair[1])
        return {name: pair_noise(first[name], second[name]) for name in names}

    dark_frames, half_frames = frames.short_darks, _near_half(frames)
    dark_pairs = [noise_of(pair) for pair in zip(dark_frames[0::2], dark_frames[1::2], strict=False)]
    per_s = 1.0 if light is None else light.photons_per_s
    noises = [(per_s * pair[0].time_s, noise_of(pair)) for pair in frames.flat_pairs]
    planes: dict[str, EmvaPlane] = {}
    dark_stacks: dict[str, Stack] = {}
    light_stacks: dict[str, Stack] = {}
    notes: list[str] = []
    for name in names:
        dark = dark_noise([noise[name] for noise in dark_pairs])
        if frames.is_clipped_at_zero:
            dark = DarkNoise(dark_frames[0].black_level_dn, dark.variance_dn2, dark.error_dn2)
        stacks = [
            stack_of(select_plane(read_codes(frame), name, places) for frame in each) for each in (dark_frames, half_frames)
        ]
        dark_stacks[name], light_stacks[name] = map(high_pass, stacks) if has_high_pass else stacks
        light_steps = [LightStep(photons, noise[name]) for photons, noise in noises]
        try:
            planes[name] = measure_plane(light_steps, dark, dark_stacks[name], light_stacks[name], frames.is_clipped_at_zero)
        except PhotositeError as error:  # of white light, the least sensitive colour may not be saturated
            problem = error.replace(part=f"ISO {frames.iso}, {name}")
            if name == names[-1] and not planes:
                raise problem from error
            notes.append(f"{problem}; {name} is left out")
    wavelengths = {} if light is None else dict.fromkeys(planes, light.wavelength_nm)
    darks, lights = ({name: stacks[name] for name in planes} for stacks in (dark_stacks, light_stacks))
    found = EmvaCamera(planes, wavelengths, darks, lights, {}, float("nan"), SECONDS if light is None else PHOTONS)
    return found, [*notes, *_notes(frames, half_frames), *([] if has_high_pass else _uneven_light(found))]


def _near_half(frames: IsoFrames) -> list[Frame]:
    """Return the flats of the exposure time whose mean is next to half of saturation."""
    flats = [frame for pair in frames.flat_pairs for frame in pair] + frames.lone_flats
    black, white = flats[0].black_level_dn, max(frame.mean_dn for frame in flats)
    times = {pair[0].time_s for pair in frames.flat_pairs}

    def off(time_s: float) -> float:
        same = [frame.mean_dn for frame in flats if frame.time_s == time_s]
        return abs(float(np.mean(same)) - black - HALF * (white - black))

    nearest = min(sorted(times), key=off)
    return [frame for frame in flats if frame.time_s == nearest]


def _notes(frames: IsoFrames, half: list[Frame]) -> list[str]:
    """Return what the frames are short of, beside what the standard asks for."""
    notes, darks = [], frames.short_darks
    if frames.is_clipped_at_zero:
        told = "half of the dark noise is cut off, so sigma_d, absolute sensitivity threshold and DSNU are told too low"
        rule = "photosite measure noise tells the read noise by the flats"
        notes.append(f"ISO {frames.iso}: codes of the dark frames end at 0: {told} and the dynamic range too high; {rule}")
    for what, found in (("dark frames", darks), ("flats next to half of saturation", half)):
        if len(found) < STACK:
            rule = f"EMVA 1288 takes {STACK} or more for DSNU and PRNU"
            notes.append(f"ISO {frames.iso}: {len(found)} {what} of {found[0].time_s:g} s; {rule}")
    if darks[0].time_s < 0.1 * half[0].time_s:
        rule = "dark current of the longer time counts as light; give dark frames of the flats' time where it matters"
        notes.append(f"ISO {frames.iso}: dark frames of {darks[0].time_s:g} s beside flats of {half[0].time_s:g} s; {rule}")
    return notes


def _uneven_light(found: EmvaCamera) -> list[str]:
    """Return a note where slow changes over the frame count as PRNU; planes too small for the filter are passed over."""
    worst = UNEVEN
    note: list[str] = []
    for name, plane in found.planes.items():
        try:
            dark, light = high_pass(found.dark_stacks[name]), high_pass(found.light_stacks[name])
        except PhotositeError:
            continue
        behind = measure_nonuniformity(dark, light, plane.gain.value)[1].total
        if plane.prnu.total > worst * behind and plane.prnu.total > 0:
            worst = plane.prnu.total / behind if behind > 0 else math.inf
            told = f"PRNU of {name} is {100.0 * plane.prnu.total:.3g} %, {100.0 * behind:.3g} % of it behind the high pass"
            note = [f"{told}: the light, or the lens, is uneven; give --high-pass"]
    return note
