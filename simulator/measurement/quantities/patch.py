"""Mean, temporal noise and signal-to-noise ratio of an even patch."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError
from simulator.exposure.later_exposures import later_exposures
from simulator.measurement.quantities.measured_frame import Area, MeasuredFrame, Plane
from simulator.measurement.quantities.quantity import Figure, Measured
from simulator.measurement.statistics.clipping import MOST_CLIPPED
from simulator.measurement.statistics.single_frame_noise import mean_noise, single_frame_noise
from simulator.pipeline.truth_maps import variance_map


@dataclass(frozen=True)
class Patch:
    """Mean signal of a patch above black, its temporal noise with rounding, and their ratio (EMVA 1288 R4.0 Linear, SNR).

    Figures: mean_dn, noise_dn [DN], snr; of a simulated frame mean_e, noise_e [e-], too: the truth's mean photoelectrons, and
    noise_dn / K with the frame's K [DN/e-] at this ISO. The signal of SNR lies above the mean code in the dark, with its dark
    current; of a raw file, which does not tell that, above the black level.
    Noise of a simulated frame is that of the truth: the root of the mean temporal variance of its photosites (of the map
    "variance" of the truth where the shot asks for it). Noise of a raw file is estimated from second differences in the one
    frame, so it holds the fixed pattern, too, and not the row noise; the patch must be even.
    Standard errors of a simulated frame count noise that rows share, row noise and banding, once a row; of a frame of several
    readings, that of the first. Those of a raw file are without it.
    Noise and SNR are nan where more than 1 % of the photosites lie at the white level.

    area: [top, left, height, width] in photosites; left out, the whole frame.
    plane: R, G (both greens), Gr, Gb, B or MONO; left out, G, and MONO of a camera without a filter.
    """

    area: Area | None = None
    plane: Plane | None = None

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Measure the patch. Raises PhotositeError for an area or a colour that the frame does not have."""
        signal = frame.signal(self.plane, self.area)
        codes = frame.planes(frame.dn, self.plane, self.area)
        clipped = sum(int((part >= frame.white_level_dn).sum()) for part in codes)
        mean_dn, dark_dn, gain = float(signal.mean()), 0.0, None
        if frame.raw is None:
            noise_dn, error_dn = mean_noise(single_frame_noise(codes, frame.white_level_dn), codes)
        else:
            variances = np.concatenate([part.ravel() for part in self._variances(frame)])
            noise_dn, error_dn = math.sqrt(float(variances.mean(dtype=np.float64))), 0.0
            sensor = frame.sensor("patch")
            gain, dark_dn = sensor.frame_gain_dn_per_e(), sensor.dark_signal_dn()
        if clipped > MOST_CLIPPED * signal.size:
            noise_dn = error_dn = math.nan
        of_mean = noise_dn / math.sqrt(signal.size) if frame.raw is None else self._error_of_mean(frame, noise_dn)
        snr = (mean_dn - dark_dn) / noise_dn if noise_dn > 0 else math.nan
        figures = {
            "mean_dn": Figure(mean_dn, "DN", of_mean),
            "noise_dn": Figure(noise_dn, "DN", error_dn),
            "snr": Figure(snr, "", math.hypot(of_mean / noise_dn, snr * error_dn / noise_dn) if noise_dn > 0 else math.nan),
        }
        if frame.raw is not None and gain is not None:
            electrons = frame.planes(frame.raw.mean_electrons[frame.raw.active], self.plane, self.area)
            mean_e = float(np.concatenate([part.ravel() for part in electrons]).mean(dtype=np.float64))
            figures["mean_e"] = Figure(mean_e, "e-", 0.0)
            figures["noise_e"] = Figure(noise_dn / gain, "e-", error_dn / gain)
        return Measured(figures)

    def _error_of_mean(self, frame: MeasuredFrame, noise_dn: float) -> float:
        """Return the standard error of the mean signal of a simulated frame [DN].

        Noise of a photosite falls with the photosites, noise that rows share with the rows, as far as theirs is independent.
        noise_dn: of one photosite, of both kinds.
        """
        sensor, rows = frame.sensor("patch"), frame.photosites_of_rows(self.plane, self.area)
        by_stage, photosites = sensor.row_noise_dn2(), float(rows.sum())
        all_dn2 = sum(by_stage.values())
        alone_dn2 = max(noise_dn**2 - all_dn2, 0.0)  # clipped codes have less noise than their rows would have
        variance_dn2 = alone_dn2 / photosites
        pairs = np.correlate(rows, rows, "full")[len(rows) - 1 :]  # of photosites in rows so far apart, for each distance
        pairs[1:] *= 2.0
        binning, averages = sensor.readout.binning, sensor.readout.averages
        apart = np.arange(len(rows)) * (binning.factor if binning is not None and averages else 1)  # rows of the sensor
        for stage, dn2 in by_stage.items():
            shared_dn2 = (noise_dn**2 - alone_dn2) * dn2 / all_dn2 if all_dn2 > 0.0 else 0.0
            variance_dn2 += shared_dn2 * max(float(pairs @ stage.row_correlation(apart)), 0.0) / photosites**2
        return math.sqrt(variance_dn2)

    def _variances(self, frame: MeasuredFrame) -> list[np.ndarray]:
        """Temporal variance of the photosites of a simulated frame [DN^2], one part for each place of the colour."""
        raw, shot = frame.simulated("patch")
        if "variance" in raw.truth:
            return frame.planes(raw.truth["variance"][raw.active], self.plane, self.area)
        if later_exposures(shot.exposure, shot.camera):
            rule = "the noise of a frame of several exposures needs the light of each; add variance to truth"
            raise PhotositeError(rule, key="truth", value=list(shot.truth))
        if shot.camera.crosstalk is not None and any(shot.camera.crosstalk.electrical_shares):
            rule = "the noise of mixed charges needs the light of each photosite and of its neighbours; add variance to truth"
            raise PhotositeError(rule, key="truth", value=list(shot.truth))
        sensor = frame.sensor("patch")
        return [variance_map(sensor, part) for part in frame.planes(raw.mean_electrons[raw.active], self.plane, self.area)]
