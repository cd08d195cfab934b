"""Colour of a camera as a raw converter needs it (DNG ColorMatrix, ForwardMatrix, AsShotNeutral)."""

import numpy as np

from simulator.color.colour_science import colour_science
from simulator.color.spectra import (
    WAVELENGTHS_NM,
    color_matching_functions,
    efficiency_on,
    illuminant,
    photons_per_joule,
    step_nm,
)
from simulator.errors import PhotositeError, require

TRAINING_REFLECTANCES = "ColorChecker N Ohta"  # 24 patches, 380-780 nm by 5 nm; Ohta 1997, in colour-science
CONNECTION_SPACE_WHITE = (0.9642, 1.0, 0.8249)  # XYZ of D50 (ICC.1:2010, 7.2.16)


def chart_reflectances(wavelengths_nm: np.ndarray) -> np.ndarray:
    """Measured reflectances of a ColorChecker, (24, wavelengths), linear between entries, held beyond the ends."""
    patches = colour_science().SDS_COLOURCHECKERS[TRAINING_REFLECTANCES].values()
    return np.stack([np.interp(wavelengths_nm, patch.wavelengths, patch.values) for patch in patches])


def camera_response(spectra: np.ndarray, wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray) -> np.ndarray:
    """Relative electrons per channel, (n, channels), of power spectra (n, wavelengths).

    quantum_efficiency: (wavelengths, channels) electrons per photon; photons per joule grow with the wavelength.
    """
    return spectra @ (photons_per_joule(wavelengths_nm)[:, None] * quantum_efficiency) * step_nm(wavelengths_nm)


def color_matrix(wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray, light: str = "D65") -> np.ndarray:
    """XYZ to camera under a light, (3, 3), as DNG 1.4 ColorMatrix wants it.

    Least squares over the 24 ColorChecker reflectances, from white-balanced camera to XYZ divided by the
    white's XYZ, with rows that add up to 1: white is kept exactly. The result is the inverse, scaled so
    that the light (Y = 1) has 1 as its largest camera value. Minimising Delta E 2000 instead gains less
    than 0.1 on the mean for the cameras tried, and needs an iterative search.
    quantum_efficiency: (wavelengths, 3) electrons per photon, R, G, B, on wavelengths_nm; linear between, zero
        outside. Only their ratios matter.
    light: a name that `illuminant` knows.
    Raises PhotositeError unless there are three channels that see different colours.
    """
    efficiency = _three_channels(wavelengths_nm, quantum_efficiency)
    camera_to_xyz = _white_preserving_fit(_balanced_camera(light, efficiency), _balanced_xyz(light))
    white_camera = as_shot_neutral(illuminant(light), WAVELENGTHS_NM, efficiency)
    observer = color_matching_functions()
    white_xyz = (illuminant(light) @ observer) / (illuminant(light) @ observer[:, 1])
    return white_camera[:, None] * np.linalg.inv(camera_to_xyz) / white_xyz


def forward_matrix(wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray, light: str = "D65") -> np.ndarray:
    """White-balanced camera under a light to XYZ of the same surfaces under D50, (3, 3) (DNG 1.4 ForwardMatrix).

    Least squares as in `color_matrix`. The surfaces are lit by D50 itself, not by a model of chromatic adaptation:
    their spectra are known. Camera white, (1, 1, 1), becomes the D50 white of the profile connection space.
    quantum_efficiency, light: as `color_matrix` takes them. Raises PhotositeError as it does.
    """
    efficiency = _three_channels(wavelengths_nm, quantum_efficiency)
    camera_to_xyz = _white_preserving_fit(_balanced_camera(light, efficiency), _balanced_xyz("D50"))
    return np.array(CONNECTION_SPACE_WHITE)[:, None] * camera_to_xyz


def _three_channels(wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray) -> np.ndarray:
    """Return the quantum efficiency on WAVELENGTHS_NM, (81, 3). Raises PhotositeError unless it has three channels."""
    quantum_efficiency = np.asarray(quantum_efficiency, dtype=np.float64)
    shape = f"shape {quantum_efficiency.shape}"
    require(quantum_efficiency.shape[1:] == (3,), "response", shape, "a colour matrix needs 3 channels")
    return efficiency_on(WAVELENGTHS_NM, wavelengths_nm, quantum_efficiency)


def _balanced_camera(light: str, efficiency: np.ndarray) -> np.ndarray:
    """Camera values of the training reflectances, white = 1: (24, 3)."""
    power = illuminant(light)
    lit = camera_response(chart_reflectances(WAVELENGTHS_NM) * power, WAVELENGTHS_NM, efficiency)
    return lit / camera_response(power[None], WAVELENGTHS_NM, efficiency)


def _balanced_xyz(light: str) -> np.ndarray:
    """XYZ of the training reflectances over that of white: (24, 3)."""
    power, observer = illuminant(light), color_matching_functions()
    return (chart_reflectances(WAVELENGTHS_NM) * power) @ observer / (power @ observer)


def _white_preserving_fit(camera: np.ndarray, xyz: np.ndarray) -> np.ndarray:
    """Matrix B with rows that add up to 1 and camera @ B.T nearest to xyz: (3, 3) from two (n, 3).

    White-balanced channels that depend on each other differ in less than two dimensions.
    """
    differences = camera[:, :2] - camera[:, 2:]
    first_two, _, rank, _ = np.linalg.lstsq(differences, xyz - camera[:, 2:], rcond=1e-6)
    if rank < 2:
        raise PhotositeError(
            'the three channels do not see three different colours; give three different curves, or set cfa to "MONO"',
            key="response",
        )
    return np.column_stack([first_two.T, 1.0 - first_two.sum(axis=0)])


def as_shot_neutral(
    scene_illuminant: np.ndarray,
    wavelengths_nm: np.ndarray,
    quantum_efficiency: np.ndarray,
    illuminant_wavelengths_nm: np.ndarray | None = None,
) -> np.ndarray:
    """Camera values of a white surface in the scene's light, (channels,), largest = 1 (DNG AsShotNeutral).

    scene_illuminant: relative spectral power, on illuminant_wavelengths_nm, or on wavelengths_nm when that is None.
    quantum_efficiency: (wavelengths, channels) electrons per photon, on wavelengths_nm; linear between, zero outside.
    Raises PhotositeError when a channel sees nothing of the light: no white balance exists then.
    """
    grid = wavelengths_nm if illuminant_wavelengths_nm is None else illuminant_wavelengths_nm
    efficiency = efficiency_on(grid, wavelengths_nm, quantum_efficiency)
    white = camera_response(np.asarray(scene_illuminant, dtype=np.float64)[None], grid, efficiency)[0]
    require(
        bool((white > 0).all()),
        "illuminant",
        f"camera white {white}",
        "a channel sees no light; choose another illuminant or response",
    )
    return white / white.max()
