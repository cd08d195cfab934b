"""Plots of a raw file of any camera, and of a camera's model at the file's ISO and time in the same plots."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from simulator.errors import require
from simulator.measurement.curves.code_response import code_moments, electrons_below_white
from simulator.measurement.curves.sensor_plots import LEAST_ELECTRONS, POINTS, CameraSetting
from simulator.measurement.quantities.quantity import Curve
from simulator.measurement.report.plot import Line, Plot
from simulator.measurement.statistics.single_frame_noise import single_frame_noise
from simulator.raw.raw_reader import RawFile
from simulator.sensor.camera.camera import Camera

MOST_LEVELS = 12  # of brightness in each colour
FAINTEST_STOPS, STEP_STOPS = -14.0, 0.25  # bins of the codes below white
MODEL_TIME_S = 0.01  # of a model, where no file says its exposure time
NAMES = ("noise_of_signal", "snr_of_signal", "codes")


def raw_plots(raw: RawFile) -> list[Plot]:
    """Return noise and SNR over the signal, and the distribution of the codes, of a raw file.

    Noise is that between photosites of one colour, from second differences in the one frame (`single_frame_noise`): temporal
    noise and fixed pattern together, without row noise. Signals are codes above black; of SNR as a share of full scale.
    """
    subject = Path(raw.path).name
    signal_dn, sigma_dn = _noise_of_planes(raw)
    full_dn = float(raw.white_level_dn - raw.black_level_dn.mean())
    return [
        *_signal_plots(subject, "", signal_dn, sigma_dn, full_dn, is_model=False),
        _code_plot(raw, subject, full_dn),
    ]


def _noise_of_planes(raw: RawFile) -> tuple[np.ndarray, np.ndarray]:
    """Signal above black and noise of each level of each colour plane [DN], in the order of the signal."""
    found = []
    for black_dn, planes in _planes(raw):
        for level in single_frame_noise(planes, raw.white_level_dn, MOST_LEVELS):
            found.append((level.level_dn - black_dn, level.sigma_dn))
    rows = sorted(one for one in found if min(one) > 0)
    signal_dn, sigma_dn = np.array(rows, np.float64).reshape(-1, 2).T
    return signal_dn, sigma_dn


def _planes(raw: RawFile) -> list[tuple[float, list[np.ndarray]]]:
    """Views of the photosites of each place of the filter's period, with their black level [DN].

    Those of a Bayer pattern apart; of a larger one, such as X-Trans, those of one colour and black level together.
    """
    if raw.cfa == "MONO":
        return [(float(raw.black_level_dn[0, 0]), [raw.mosaic])]
    height, width = raw.black_level_dn.shape
    letters = raw.cfa.replace("/", "")
    found: dict[tuple[object, float], list[np.ndarray]] = {}
    for place in range(height * width):
        y, x = divmod(place, width)
        color = place if height == width == 2 else letters[place]
        found.setdefault((color, float(raw.black_level_dn[y, x])), []).append(raw.mosaic[y::height, x::width])
    return [(black_dn, planes) for (_, black_dn), planes in found.items()]


def model_plots(camera: Camera, iso: float | None, time_s: float | None) -> list[Plot]:
    """Return noise and SNR over the signal of a camera as `raw_plots` measures them: with the fixed pattern, without rows.

    iso, time_s: of the raw file that it is compared with. Raises PhotositeError without an ISO, or for one that the camera does
    not have.
    """
    rule = "the raw file does not say its ISO; give it with --iso, such as --iso 400"
    require(iso is not None and iso > 0, "--iso", iso, rule)
    assert iso is not None
    setting = CameraSetting.of(camera, time_s or MODEL_TIME_S, (round(iso),))
    whole = setting.sensor(round(iso))
    sensor = replace(whole, stages=tuple(stage for stage in whole.stages if not stage.is_common_to_rows))
    signal = code_moments(sensor, electrons_below_white(sensor, LEAST_ELECTRONS, POINTS))
    above_dn = signal.mean - sensor.moments(0.0).mean
    shown = above_dn > 0
    sigma_dn = np.sqrt(signal.variance + signal.fixed_variance)[shown]
    subject = f"{camera.make} {camera.model}"
    return _signal_plots(subject, f"model, ISO {round(iso)}", above_dn[shown], sigma_dn, sensor.full_scale_dn(), is_model=True)


def _signal_plots(
    subject: str, label: str, signal_dn: np.ndarray, sigma_dn: np.ndarray, full_dn: float, is_model: bool
) -> list[Plot]:
    noise = Curve(signal_dn, sigma_dn, "signal above black", "DN", "noise between photosites", "DN")
    snr = Curve(signal_dn / full_dn, signal_dn / sigma_dn, "signal, share of full scale", "", "SNR", "")
    style = {"has_points": not is_model, "has_line": is_model}
    note = (
        "Temporal noise and fixed pattern together, without row noise; of a raw file from second differences in the one frame."
    )
    texts = ("Noise against signal", "SNR against signal")
    return [
        Plot(name, title, (Line(curve, label, subject, **style),), note, "log", "log")
        for name, title, curve in zip(NAMES, texts, (noise, snr), strict=False)
    ]


def _code_plot(raw: RawFile, subject: str, full_dn: float) -> Plot:
    """Share of all photosites in each quarter of a stop below white; those at black and below are in none."""
    edges = np.arange(FAINTEST_STOPS, STEP_STOPS, STEP_STOPS)
    counts = np.zeros(len(edges) - 1)
    for black_dn, planes in _planes(raw):
        codes = np.sum([np.bincount(plane.ravel(), minlength=2**16) for plane in planes], axis=0)
        above_dn = np.arange(2**16) - black_dn
        lit = above_dn > 0
        stops = np.minimum(np.log2(above_dn[lit] / full_dn), -1e-9)
        counts += np.histogram(stops, edges, weights=codes[lit])[0]
    share = 100.0 * counts / raw.mosaic.size
    curve = Curve(0.5 * (edges[1:] + edges[:-1]), share, "code above black, from white", "stops", "photosites", "%")
    return Plot(
        "codes", "Codes", (Line(curve, "", subject),), "In quarters of a stop; photosites at black and below are in none."
    )


def wanted_plots(plots: Sequence[Plot], names: Sequence[str]) -> list[Plot]:
    """Return the plots of these names; none: all. Raises PhotositeError for another name."""
    for name in names:
        require(name in NAMES, "--only", name, f"plots of raw files are {', '.join(NAMES)}")
    return [plot for plot in plots if not names or plot.name in names]
