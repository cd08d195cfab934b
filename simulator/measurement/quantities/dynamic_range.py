"""Dynamic range in stops: from white down to the signal of a least SNR, of one photosite or of the circle of confusion."""

import math
from dataclasses import dataclass

from scipy.optimize import root_scalar

from simulator.measurement.quantities.measured_frame import MeasuredFrame
from simulator.measurement.quantities.quantity import Figure, Measured
from simulator.measurement.statistics.signal_to_noise import CIRCLES_PER_DIAGONAL, photographic_snr
from simulator.sensor.sensor_plan import SensorPlan
from simulator.units import Micrometres


@dataclass(frozen=True)
class DynamicRange:
    """Engineering dynamic range at the frame's ISO and time (EMVA 1288 R4.0 Linear): full scale over the signal of SNR 1.

    Figures: range_ev = log2(full_scale_e / least_e); full_scale_e [e-], which raise the code from dark to white; least_e [e-],
    at which mean / temporal noise, rounding included, is 1, by the camera's stages; for a linear sensor
    1/2 + sqrt(sigma^2 + 1/4) with the dark noise sigma [e-]. From the camera, exact; it takes a simulated frame.
    """

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Compute the range. Raises PhotositeError for a bare file."""
        return Measured(range_figures(frame.sensor("dynamic_range"), 1.0))


@dataclass(frozen=True)
class PhotonsToPhotos:
    """Photographic dynamic range, PDR (Claff, photonstophotos.net): its low end has an SNR of 20 in the circle of confusion.

    Figures: as of dynamic_range, and snr, that of one photosite at the low end: 20 / (sqrt(pi) / 2 c / p) for photosites p
    apart; binned photosites are one. From the camera, exact; it takes a simulated frame.

    circle_of_confusion_um: diameter c on the sensor; left out, the sensor's diagonal / 1291, which is 22 um on a Nikon D300.
    """

    circle_of_confusion_um: Micrometres | None = None

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Compute the range. Raises PhotositeError for a bare file."""
        return Measured(photographic_range(frame.sensor("photons_to_photos"), self.circle_of_confusion_um))


def photographic_range(sensor: SensorPlan, circle_um: float | None = None) -> dict[str, Figure]:
    """Return the figures of the photographic dynamic range of a sensor. circle_um: of confusion; None: diagonal / 1291 [um]."""
    camera, binning = sensor.camera, sensor.readout.binning
    if circle_um is None:
        circle_um = 1e3 * math.hypot(*camera.sensor_mm) / CIRCLES_PER_DIAGONAL
    snr = photographic_snr(camera.pixel_pitch_um * (1 if binning is None else binning.factor), circle_um)
    return {**range_figures(sensor, snr), "snr": Figure(snr, "", 0.0)}


def range_figures(sensor: SensorPlan, snr: float) -> dict[str, Figure]:
    """Return the figures of a range whose low end has this SNR; nan where no signal below white has it."""
    dark, full_e = sensor.moments(0.0).mean, sensor.electrons_at_white()

    def excess(log_electrons: float) -> float:
        signal = sensor.moments(math.exp(log_electrons))
        return (signal.mean - dark) / math.sqrt(signal.variance) - snr if signal.variance > 0 else math.inf

    least_e = math.nan
    low, high = math.log(1e-6), math.log(max(full_e, 1e-6))
    if full_e > 0 and excess(low) < 0 < excess(high - 1e-9):
        least_e = math.exp(root_scalar(excess, bracket=(low, high - 1e-9), xtol=1e-12).root)
    return {
        "range_ev": Figure(math.log2(full_e / least_e) if least_e > 0 else math.nan, "EV", 0.0),
        "least_e": Figure(least_e, "e-", 0.0),
        "full_scale_e": Figure(full_e, "e-", 0.0),
    }
