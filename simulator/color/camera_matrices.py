"""Colour of a camera as a raw converter needs it (DNG ColorMatrix, ForwardMatrix, AsShotNeutral)."""

import hashlib
from functools import cache

import numpy as np

from simulator.color import color_tables
from simulator.color.color_tables import read_forward_matrices, read_spectra
from simulator.color.colour_science import colour_science
from simulator.color.spectra import (
    WAVELENGTHS_NM,
    illuminant,
    integral_weights,
    tristimulus,
)
from simulator.errors import PhotositeError, require

TRAINING_REFLECTANCES = "ColorChecker N Ohta"  # 24 patches, 380-780 nm by 5 nm; Ohta 1997
CALIBRATION_LIGHTS = ("D65", "A")  # of the matrices in a DNG
CONNECTION_SPACE_WHITE = (0.9642, 1.0, 0.8249)  # XYZ of D50 (ICC.1:2010, 7.2.16)
_SMOOTHING = 0.05  # Delta E below which a patch hardly counts: the search needs a derivative where a colour is exact


def chart_reflectances(wavelengths_nm: np.ndarray) -> np.ndarray:
    """Measured reflectances of a ColorChecker, (24, wavelengths), linear between entries, held beyond the ends."""
    table = read_spectra(color_tables.COLOR_CHECKER)
    return np.stack([np.interp(wavelengths_nm, *table.curve(patch)) for patch in table.curves])


def camera_response(
    spectra: np.ndarray, grid_nm: np.ndarray, wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray
) -> np.ndarray:
    """Relative electrons per channel, (..., channels), of power spectra (..., grid) sampled on grid_nm.

    quantum_efficiency: (wavelengths, channels) electrons per photon, on wavelengths_nm; photons per joule grow with the
        wavelength. The integral is that of all scenes (`integral_weights`).
    """
    return spectra @ integral_weights(grid_nm, wavelengths_nm, quantum_efficiency, of_photons=True)


def color_matrix(wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray, light: str = "D65") -> np.ndarray:
    """XYZ to camera under a light, (channels, 3), as DNG 1.4 ColorMatrix wants it.

    Least squares over the 24 ColorChecker reflectances, from white-balanced camera to XYZ divided by the
    white's XYZ, with rows that add up to 1: white is kept exactly. The result is the inverse, scaled so
    that the light (Y = 1) has 1 as its largest camera value. Minimising Delta E 2000 instead gains less
    than 0.1 on the mean for the cameras tried, and needs an iterative search. Four channels have no inverse: the
    least squares are those from XYZ to camera, which readers invert in the sense of least squares.
    quantum_efficiency: (wavelengths, 3 or 4) electrons per photon, R, G, B and where there is one W, on
        wavelengths_nm; linear between, zero outside. Only their ratios matter.
    light: a name that `illuminant` knows.
    Raises PhotositeError unless there are three channels that see different colours, or four.
    """
    has_four = np.shape(quantum_efficiency)[1:] == (4,)
    if not has_four:
        _check_three_channels(quantum_efficiency)
    camera, xyz = _balanced_camera(light, wavelengths_nm, quantum_efficiency), _balanced_xyz(light)
    to_camera = _white_preserving_fit(xyz, camera) if has_four else np.linalg.inv(_white_preserving_fit(camera, xyz))
    white_camera = as_shot_neutral(illuminant(light), wavelengths_nm, quantum_efficiency, WAVELENGTHS_NM)
    white_xyz = tristimulus(illuminant(light))
    white_xyz /= white_xyz[1]
    return white_camera[:, None] * to_camera / white_xyz


def forward_matrix(wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray, light: str = "D65") -> np.ndarray:
    """White-balanced camera under a light to XYZ in the profile connection space, (3, 3) (DNG 1.7.1 ForwardMatrix).

    The true colours are those of the 24 ColorChecker reflectances in this light, adapted to D50 by linear Bradford, which is
    the adaptation of DNG and ICC profiles. The matrix has nearly the least mean Delta E 2000 to them of all that take camera
    white, (1, 1, 1), to the white of D50, as the tag demands. Entries are whole ten-thousandths, as camera makers write them.
    quantum_efficiency, light: as `color_matrix` takes them. Raises PhotositeError as it does.
    """
    _check_three_channels(quantum_efficiency)
    known = read_forward_matrices().get((response_key(wavelengths_nm, quantum_efficiency), light))
    if known is None:
        own, table = (np.ascontiguousarray(each, dtype=np.float64) for each in (wavelengths_nm, quantum_efficiency))
        known = _found_once(own.tobytes(), table.tobytes(), light)
    return np.array(known)


def response_key(wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray) -> str:
    """Return a text that is another for every response."""
    digest = hashlib.sha256()
    for each in (wavelengths_nm, quantum_efficiency):
        digest.update(np.ascontiguousarray(each, dtype="<f8").tobytes())
    return digest.hexdigest()[:32]


@cache
def _found_once(wavelengths: bytes, efficiency: bytes, light: str) -> tuple[tuple[float, ...], ...]:
    """Search for the forward matrix of a response, of which the bytes of float64 arrays are given: a shot asks each time."""
    return search_forward_matrix(np.frombuffer(wavelengths), np.frombuffer(efficiency).reshape(-1, 3), light)


def search_forward_matrix(
    wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray, light: str
) -> tuple[tuple[float, ...], ...]:
    """Search for `forward_matrix`, in some tenths of a second; colour-science and SciPy's optimisers are imported for it."""
    from scipy.optimize import minimize

    curves = wavelengths_nm, quantum_efficiency
    camera, white = _balanced_camera(light, *curves), np.array(CONNECTION_SPACE_WHITE)
    true_xyz = adapted_to_d50(_balanced_xyz(light) * tristimulus(illuminant(light)), light)
    start = _white_preserving_fit(camera, true_xyz / white)

    def matrix_of(first_two: np.ndarray) -> np.ndarray:
        free = first_two.reshape(3, 2)
        return white[:, np.newaxis] * np.column_stack([free, 1.0 - free.sum(axis=1)])

    def error_of(first_two: np.ndarray) -> float:
        differences = delta_e_in_d50(camera @ matrix_of(first_two).T, true_xyz)
        return float(np.mean(np.hypot(differences, _SMOOTHING)))

    found = matrix_of(minimize(error_of, start[:, :2].ravel(), method="BFGS", options={"gtol": 1e-6}).x)
    first_two = np.round(found[:, :2], 4)
    rounded = np.column_stack([first_two, np.round(white - first_two.sum(axis=1), 4)])
    return tuple(tuple(map(float, row)) for row in rounded)


def adapted_to_d50(xyz: np.ndarray, light: str) -> np.ndarray:
    """XYZ (..., 3) in a light, of any scale, to XYZ under D50 with white's Y = 1, by linear Bradford (ICC.1:2010, annex E)."""
    white = tristimulus(illuminant(light))
    adapt = colour_science().adaptation.matrix_chromatic_adaptation_VonKries(
        white / white[1], np.array(CONNECTION_SPACE_WHITE), "Bradford"
    )
    return xyz / white[1] @ adapt.T


def delta_e_in_d50(one_xyz: np.ndarray, other_xyz: np.ndarray) -> np.ndarray:
    """Delta E 2000 (CIE 142) of colours (..., 3) under D50, white's Y = 1: (...)."""
    colour = colour_science()
    white_xy = colour.XYZ_to_xy(np.array(CONNECTION_SPACE_WHITE))
    pair = (colour.XYZ_to_Lab(np.maximum(xyz, 0.0), white_xy) for xyz in (one_xyz, other_xyz))
    return colour.delta_E(*pair, method="CIE 2000")


def _check_three_channels(quantum_efficiency: np.ndarray) -> None:
    """Raise PhotositeError unless the response has three channels."""
    shape = np.shape(quantum_efficiency)
    require(shape[1:] == (3,), "response", f"shape {shape}", "a colour matrix needs 3 channels")


def _balanced_camera(light: str, wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray) -> np.ndarray:
    """Camera values of the training reflectances, white = 1: (24, channels)."""
    power = illuminant(light)
    spectra = np.vstack([power, chart_reflectances(WAVELENGTHS_NM) * power])
    white, *lit = camera_response(spectra, WAVELENGTHS_NM, wavelengths_nm, quantum_efficiency)
    return np.array(lit) / white


def _balanced_xyz(light: str) -> np.ndarray:
    """XYZ of the training reflectances over that of white: (24, 3)."""
    power = illuminant(light)
    return tristimulus(chart_reflectances(WAVELENGTHS_NM) * power) / tristimulus(power)


def _white_preserving_fit(camera: np.ndarray, xyz: np.ndarray) -> np.ndarray:
    """Matrix B with rows that add up to 1 and camera @ B.T nearest to xyz: (m, 3) from (n, 3) and (n, m).

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
    white = camera_response(np.asarray(scene_illuminant, dtype=np.float64), grid, wavelengths_nm, quantum_efficiency)
    require(
        bool((white > 0).all()),
        "illuminant",
        f"camera white {white}",
        "a channel sees no light; choose another illuminant or response",
    )
    return white / white.max()
