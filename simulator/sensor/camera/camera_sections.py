"""Sections of a camera: line of its ISO table, conversion gain, readout window, spectral response, colour matrix."""

from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.sensor.stages.tukey_lambda_polynomial import GREATEST_LAMBDA, LEAST_LAMBDA
from simulator.units import DigitalNumbers, DigitalNumbersPerElectron


@dataclass(frozen=True)
class IsoSetting:
    """Parameters at one ISO: a measured line of a camera's table, or one interpolated between such lines.

    gain_dn_per_e: K of EMVA 1288 [DN/e-], > 0.
    read_noise_dn: total temporal dark noise of one photosite in the raw file, without row noise [DN], >= 0.
    tukey_lambda: shape of the read noise's Tukey-lambda distribution, -0.3 to 0.25; normal when left out.
    row_noise_dn: standard deviation of the offset that a whole row shares [DN], >= 0.
    color_bias_dn: per-channel black offset of red, green beside red, green beside blue, blue [DN].
    black_level_dn: pedestal at this ISO [DN]; the camera's when left out.
    white_level_dn: code at which the camera saturates at this ISO [DN]; the camera's when left out.
    """

    gain_dn_per_e: DigitalNumbersPerElectron
    read_noise_dn: DigitalNumbers
    tukey_lambda: float | None = None
    row_noise_dn: DigitalNumbers = 0.0
    color_bias_dn: tuple[DigitalNumbers, DigitalNumbers, DigitalNumbers, DigitalNumbers] | None = None
    black_level_dn: DigitalNumbers | None = None
    white_level_dn: DigitalNumbers | None = None

    def __post_init__(self) -> None:
        gain, key = self.gain_dn_per_e, "camera.iso_table"
        require(0 < gain < np.inf, f"{key}.gain", f"{gain:g} DN/e-", "give a gain above 0 DN/e-")
        for name, sigma in (("read_noise", self.read_noise_dn), ("row_noise", self.row_noise_dn)):
            require(0 <= sigma < np.inf, f"{key}.{name}", f"{sigma:g} DN", "a standard deviation is not negative")
        shape = self.tukey_lambda
        good = shape is None or LEAST_LAMBDA <= shape <= GREATEST_LAMBDA
        require(good, f"{key}.tukey_lambda", shape, f"give {LEAST_LAMBDA} to {GREATEST_LAMBDA}, or none")
        require(shape is None or self.read_noise_dn > 0, f"{key}.tukey_lambda", shape, "there is no read noise to shape")

    @property
    def levels_dn(self) -> tuple[float, float]:
        """Black and white level [DN] of a setting that has both, as those of Camera.iso_setting do."""
        assert self.black_level_dn is not None and self.white_level_dn is not None  # Camera.iso_setting fills them in
        return self.black_level_dn, self.white_level_dn


@dataclass(frozen=True)
class ConversionGainSwitch:
    """A second conversion gain [V/e-] of the photosites, which the ISO setting selects (dual conversion gain).

    iso: first ISO of high conversion gain.
    ratio: high over low conversion gain, above 1; for a read_noise_model only, since a table includes its effect.
    """

    iso: int
    ratio: float | None = None

    def __post_init__(self) -> None:
        require(self.iso > 0, "camera.conversion_gain.iso", self.iso, "an ISO is above 0")
        good = self.ratio is None or 1 < self.ratio < np.inf
        require(good, "camera.conversion_gain.ratio", self.ratio, "high over low conversion gain is above 1")


@dataclass(frozen=True)
class ColorMatrix:
    """A published colour matrix of the camera.

    xyz_to_camera: 3 rows of 3, XYZ under D65 to camera RGB, as DNG's ColorMatrix1 (its scale does not matter).
    in_dng: whether the DNG carries it. By default the DNG carries the matrix fitted to the response, which
        develops in the right colours whatever the response is; this one then serves as a check of the response.
    """

    xyz_to_camera: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    in_dng: bool = False

    def __post_init__(self) -> None:
        table = np.array(self.xyz_to_camera, dtype=np.float64)
        good = table.shape == (3, 3) and bool(np.isfinite(table).all()) and np.linalg.matrix_rank(table) == 3
        require(good, "camera.color_matrix.xyz_to_camera", table.tolist(), "give 3 independent rows of 3 numbers")


@dataclass(frozen=True)
class Window:
    """Rectangle of photosites of the sensor: x, y of its upper left photosite, width and height [px]."""

    x: int
    y: int
    width: int
    height: int

    def __str__(self) -> str:
        return f"{self.width} x {self.height} at ({self.x}, {self.y})"


@dataclass(frozen=True)
class SpectralResponse:
    """Quantum efficiency (filter, microlens and silicon together) per colour.

    wavelengths_nm: (wavelengths,) ascending, evenly spaced [nm].
    quantum_efficiency: (wavelengths, channels) electrons per photon; channels as `Cfa.letters` has them, or one for MONO.
    """

    wavelengths_nm: np.ndarray
    quantum_efficiency: np.ndarray

    def __post_init__(self) -> None:
        grid, table = np.asarray(self.wavelengths_nm), np.asarray(self.quantum_efficiency)
        fits = table.ndim == 2 and len(table) == grid.size > 1 and table.shape[1] in (1, 3, 4)
        rule = (
            f"needs {grid.size} lines, one per wavelength, of 3 values (red, green, blue), 4 with white, or 1 without a filter"
        )
        require(fits, "camera.response.quantum_efficiency", f"shape {table.shape}", rule)
        ascends = bool((np.diff(grid) > 0).all())
        require(ascends, "camera.response.wavelengths", f"{grid[0]:g} to {grid[-1]:g} nm", "give ascending wavelengths")
        good = bool(np.isfinite(table).all()) and table.min() >= 0
        require(good, "camera.response.quantum_efficiency", table.min(), "electrons per photon are not negative")

    @property
    def channels(self) -> int:
        """Number of curves."""
        return np.shape(self.quantum_efficiency)[1]
