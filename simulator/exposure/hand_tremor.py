"""Motion of a hand as a random process of a stated spectrum."""

from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.exposure.camera_motion import ANY_TIME, Poses
from simulator.exposure.path_words import LARGEST_SEED, to_normals, uniforms
from simulator.units import DegreesPerSecond, Hertz, MetresPerSecond

LINES = 128  # sinusoids of each axis, one in each of as many equal bands


@dataclass(frozen=True)
class HandTremor:
    """Gaussian random motion of the camera: the power spectrum of its speed is proportional to frequency^slope within a band.

    The speed about or along each axis is a sum of 128 sinusoids, each at a random frequency of its own part of the band with
    normal amplitudes of sine and cosine (Rice 1944). So it exists at any time, and any instants can be evaluated.
    rms_deg_per_s: root mean square of the speed of rotation over many seeds, the three axes together, which have equal shares
        [deg/s].
    lowest_hz: lower end of the band [Hz].
    highest_hz: upper end of the band [Hz].
    slope: exponent of the frequency in the power spectrum of the speed; 0: the same power everywhere.
    location_rms_m_per_s: as `rms_deg_per_s`, of the speed of the lens's centre [m/s].
    seed: chooses the path.
    """

    rms_deg_per_s: DegreesPerSecond
    lowest_hz: Hertz = 2.0
    highest_hz: Hertz = 12.0
    slope: float = 0.0
    location_rms_m_per_s: MetresPerSecond = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        rms, low, high, moved = self.rms_deg_per_s, self.lowest_hz, self.highest_hz, self.location_rms_m_per_s
        require(0 <= rms < np.inf, "motion.camera.rms", f"{rms:g} deg/s", "give 0 or more, such as 2 deg/s")
        require(0 < low < np.inf, "motion.camera.lowest", f"{low:g} Hz", "give a frequency above 0 Hz, such as 2 Hz")
        require(low < high < np.inf, "motion.camera.highest", f"{high:g} Hz", f"give one above the lowest, {low:g} Hz")
        require(abs(self.slope) <= 10, "motion.camera.slope", self.slope, "give -10 to 10, such as 0")
        require(0 <= moved < np.inf, "motion.camera.location_rms", f"{moved:g} m/s", "give 0 or more, such as 0.01 m/s")
        require(0 <= self.seed <= LARGEST_SEED, "motion.camera.seed", self.seed, "give 0 to 2^64 - 1")

    @property
    def span_s(self) -> tuple[float, float]:
        """No ends [s]."""
        return ANY_TIME

    @property
    def fastest_hz(self) -> float:
        """Upper end of the band [Hz]; 0 for a hand at rest."""
        return self.highest_hz if self.rms_deg_per_s or self.location_rms_m_per_s else 0.0

    def poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses at some instants (instants,) [s]: the integral of the speeds from clock 0 on."""
        hertz, cosine, sine = self._lines()
        times_s, moved = np.asarray(times_s, np.float64), np.zeros((len(times_s), len(hertz)))
        for axis in np.flatnonzero(cosine.any(axis=1)):
            omega = 2.0 * np.pi * hertz[axis]
            phase = np.multiply.outer(times_s, omega)
            # A sum, not a product of matrices, whose last bits depend on how many instants there are.
            moved[:, axis] = np.sum((cosine[axis] * np.sin(phase) + sine[axis] * (1.0 - np.cos(phase))) / omega, axis=1)
        return Poses(moved[:, :3], moved[:, 3:])

    def speeds(self, times_s: np.ndarray) -> Poses:
        """Return the derivatives of the poses at some instants (instants,) [s]."""
        hertz, cosine, sine = self._lines()
        times_s, speed = np.asarray(times_s, np.float64), np.zeros((len(times_s), len(hertz)))
        for axis in np.flatnonzero(cosine.any(axis=1)):
            phase = np.multiply.outer(times_s, 2.0 * np.pi * hertz[axis])
            speed[:, axis] = np.sum(cosine[axis] * np.cos(phase) + sine[axis] * np.sin(phase), axis=1)
        return Poses(speed[:, :3], speed[:, 3:])

    def _lines(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return frequencies [Hz] and amplitudes of cosine and sine [rad/s] and [m/s], (6 axes, LINES) each."""
        step = (self.highest_hz - self.lowest_hz) / LINES
        within, *pairs = uniforms(self.seed, 5 * 6 * LINES).reshape(5, 6, LINES)
        cosine, sine = to_normals(np.reshape(pairs, (2, 2, 6, LINES)))
        hertz = self.lowest_hz + step * (np.arange(LINES) + within)
        ends = self.lowest_hz + step * np.arange(LINES + 1)
        power = np.diff(np.log(ends) if self.slope == -1.0 else ends ** (self.slope + 1.0) / (self.slope + 1.0))
        rms = np.repeat([np.radians(self.rms_deg_per_s), self.location_rms_m_per_s], 3)[:, None] / np.sqrt(3.0)
        deviation = rms * np.sqrt(power / power.sum())
        return hertz, deviation * cosine, deviation * sine
