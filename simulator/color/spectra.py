"""Spectra: light sources, the eye's luminous efficiency, reflectance bases, and quantum efficiency on a grid.

One rule holds for all spectra: a table is a function of wavelength, linear between its entries and zero outside them, and
integrals of products of two tables are those of these functions, without further error (`integral_weights`). So the same light
gives the same electrons on any grid that holds it, and a band's ends count as far as the band reaches.
Tabulated data are those of `color_tables`, whose files name their origin.
"""

import difflib
import re
from functools import lru_cache

import numpy as np

from simulator.color import color_tables
from simulator.color.color_tables import read_spectra
from simulator.errors import PhotositeError, require

WAVELENGTHS_NM = np.arange(380.0, 781.0, 5.0)
WAVELENGTHS_NM.setflags(write=False)

PLANCK_J_S = 6.62607015e-34  # SI 2019, exact
LIGHT_SPEED_M_S = 299792458.0  # SI 2019, exact
BOLTZMANN_J_K = 1.380649e-23  # SI 2019, exact
# K_cd of the SI at 540 THz. The CIE's K_m = 683.002 lm/W is 3 parts per million more.
LUMINOUS_EFFICACY_LM_W = 683.0

ILLUMINANTS = (
    *("A", "B", "C", "D50", "D55", "D60", "D65", "D75", "E"),
    *(f"FL{number}" for number in range(1, 13)),
    *(f"HP{number}" for number in range(1, 6)),
    *("LED-B1", "LED-B2", "LED-B3", "LED-B4", "LED-B5", "LED-BH1", "LED-RGB1", "LED-V1", "LED-V2"),
)
UPSAMPLING_METHODS = ("mallett2019",)
_BLACKBODY = re.compile(r"(?:blackbody\s+)?([0-9]+(?:\.[0-9]+)?)\s*K")


def photons_per_joule(wavelengths_nm: np.ndarray) -> np.ndarray:
    """Photons in one joule of light: lambda / (h c) [1/J], same shape as the wavelengths [nm]."""
    return np.asarray(wavelengths_nm, dtype=np.float64) * 1e-9 / (PLANCK_J_S * LIGHT_SPEED_M_S)


def _observer_table() -> tuple[np.ndarray, np.ndarray]:
    observer = read_spectra(color_tables.OBSERVER)
    return observer.wavelengths_nm, observer.columns()


def color_matching_functions(wavelengths_nm: np.ndarray = WAVELENGTHS_NM) -> np.ndarray:
    """CIE 1931 2 degree x-bar, y-bar, z-bar, (wavelengths, 3), linear between the 1 nm entries, zero outside 360-830 nm.

    Source: CIE 018:2019 table.
    """
    grid, values = _observer_table()
    columns = [np.interp(wavelengths_nm, grid, values[:, column], left=0.0, right=0.0) for column in range(3)]
    return np.stack(columns, axis=-1)


def luminous_efficiency(wavelengths_nm: np.ndarray = WAVELENGTHS_NM) -> np.ndarray:
    """V(lambda), which is the CIE 1931 y-bar, (wavelengths,)."""
    return color_matching_functions(wavelengths_nm)[:, 1]


def integral_weights(
    grid_nm: np.ndarray, wavelengths_nm: np.ndarray, curves: np.ndarray, *, of_photons: bool = False
) -> np.ndarray:
    """Weights that turn samples of a spectrum into its integrals with some curves, (grid, channels) float64 [nm].

    samples (..., grid) @ weights = integral of s(lambda) c(lambda) dlambda, where s and c are linear between their entries and
    zero outside them. Between neighbouring entries of either table the product is a polynomial of degree 2, or 3 with the
    factor lambda / (h c), which the two-point Gauss-Legendre rule integrates exactly (Abramowitz and Stegun 25.4.29).
    grid_nm: (grid,) where the spectrum is sampled, ascending [nm]. wavelengths_nm, curves: (wavelengths,) ascending [nm] and
        (wavelengths, channels). of_photons: multiply by the photons in a joule, lambda / (h c) [1/J].
    The result cannot be written to. Raises PhotositeError unless both grids ascend and have two entries at least.
    """
    grid, own, table = (np.asarray(each, dtype=np.float64) for each in (grid_nm, wavelengths_nm, curves))
    return _integral_weights(grid.tobytes(), own.tobytes(), table.tobytes(), (grid.shape, own.shape, table.shape), of_photons)


@lru_cache(maxsize=64)  # a frame asks for the same ones several times, and so do frames of one camera
def _integral_weights(
    grid_nm: bytes, wavelengths_nm: bytes, curves: bytes, shapes: tuple[tuple[int, ...], ...], of_photons: bool
) -> np.ndarray:
    """`integral_weights` of arrays of float64, given as bytes and shapes."""
    texts = grid_nm, wavelengths_nm, curves
    grid, own, table = (np.frombuffer(text).reshape(shape) for text, shape in zip(texts, shapes, strict=True))
    for each in (grid, own):
        ascends = each.ndim == 1 and each.size > 1 and bool((np.diff(each) > 0).all())
        if not ascends:
            raise PhotositeError("give two or more ascending wavelengths", key="wavelengths", value=f"{each} nm")
    knots = np.union1d(grid, own)
    knots = knots[(knots >= max(grid[0], own[0])) & (knots <= min(grid[-1], own[-1]))]
    middle, half = (knots[1:] + knots[:-1]) / 2.0, np.diff(knots) / 2.0
    nodes_nm = np.concatenate([middle - half / np.sqrt(3.0), middle + half / np.sqrt(3.0)])
    factors = np.tile(half, 2) * (photons_per_joule(nodes_nm) if of_photons else 1.0)
    values = np.stack([np.interp(nodes_nm, own, curve) for curve in table.T], axis=-1) * factors[:, np.newaxis]
    left = np.searchsorted(grid, nodes_nm) - 1
    share = ((nodes_nm - grid[left]) / np.diff(grid)[left])[:, np.newaxis]
    weights = np.zeros((grid.size, table.shape[1]))
    np.add.at(weights, left, values * (1.0 - share))
    np.add.at(weights, left + 1, values * share)
    weights.setflags(write=False)
    return weights


def tristimulus(spectra: np.ndarray, wavelengths_nm: np.ndarray = WAVELENGTHS_NM) -> np.ndarray:
    """Integrals of spectra (..., wavelengths) with x-bar, y-bar and z-bar of the CIE 1931 observer, (..., 3), times nm."""
    return np.asarray(spectra) @ integral_weights(wavelengths_nm, *_observer_table())


def luminance_cd_m2(spectrum_w_m2_sr_nm: np.ndarray, wavelengths_nm: np.ndarray = WAVELENGTHS_NM) -> np.ndarray:
    """Luminance of spectral radiances (..., wavelengths): 683 lm/W times the integral of L V dlambda [cd m^-2].

    With irradiance in place of radiance the result is the illuminance [lx].
    """
    return LUMINOUS_EFFICACY_LM_W * tristimulus(spectrum_w_m2_sr_nm, wavelengths_nm)[..., 1]


def blackbody_temperature_k(name: str) -> float | None:
    """Temperature in a name such as "3200 K" or "blackbody 3200 K" [K]; None when the name is not of that form."""
    match = _BLACKBODY.fullmatch(name.strip())
    return float(match.group(1)) if match else None


def check_illuminant(name: str, key: str = "illuminant") -> None:
    """Raise PhotositeError, offering the nearest name, unless `illuminant(name)` knows it; reads no tables."""
    temperature_k = blackbody_temperature_k(name)
    if temperature_k is not None:
        require(500 <= temperature_k <= 100_000, key, name, "give a blackbody between 500 K and 100000 K")
    elif name not in ILLUMINANTS:
        near = difflib.get_close_matches(name.upper(), ILLUMINANTS, n=1, cutoff=0.4)
        offer = f"did you mean {near[0]}? " if near else ""
        raise PhotositeError(
            f'no such illuminant; {offer}Known: {", ".join(ILLUMINANTS)}, or "blackbody 3200 K"', key=key, value=name
        )


def illuminant(name: str, wavelengths_nm: np.ndarray = WAVELENGTHS_NM) -> np.ndarray:
    """Relative spectral power of a light source, 1 at 560 nm, (wavelengths,) float64.

    name: a CIE illuminant such as "A", "D65", "FL2" (CIE 15:2018), "E", or a blackbody such as "3200 K" (Planck).
    CIE tables are linear between their 5 nm entries and zero outside them (380-780 nm at least).
    Raises PhotositeError for an unknown name.
    """
    check_illuminant(name)
    temperature_k = blackbody_temperature_k(name)
    wavelengths_nm = np.asarray(wavelengths_nm, dtype=np.float64)
    if temperature_k is not None:
        return _planck(wavelengths_nm, temperature_k) / _planck(np.float64(560.0), temperature_k)
    grid_nm, values = read_spectra(color_tables.ILLUMINANTS).curve(name)
    power = np.interp(wavelengths_nm, grid_nm, values, left=0.0, right=0.0)
    return power / np.interp(560.0, grid_nm, values)


def _planck(wavelengths_nm: np.ndarray | np.float64, temperature_k: float) -> np.ndarray:
    """Return a number in proportion to the spectral radiance of a blackbody (Planck's law), per wavelength [nm]."""
    exponent = PLANCK_J_S * LIGHT_SPEED_M_S / (wavelengths_nm * 1e-9 * BOLTZMANN_J_K * temperature_k)
    return wavelengths_nm**-5.0 / np.expm1(exponent)


def reflectance_basis(method: str) -> np.ndarray:
    """Reflectances of linear sRGB red, green and blue, (3, 81) on WAVELENGTHS_NM; they add up to 1 at every wavelength.

    A colour's reflectance is its linear RGB times these, so a picture stays three planes.
    method: "mallett2019": Mallett and Yuksel 2019, "Spectral Primary Decomposition for Rendering with sRGB
        Reflectance", divided by their sum, which differs from 1 by 1e-5 at most.
    Raises PhotositeError for an unknown method.
    """
    known = ", ".join(UPSAMPLING_METHODS)
    require(method in UPSAMPLING_METHODS, "upsampling", method, f"no such method; known: {known}")
    basis = read_spectra(color_tables.BASIS).columns().T
    return basis / basis.sum(axis=0)


def efficiency_on(grid_nm: np.ndarray, wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray) -> np.ndarray:
    """Quantum efficiency (wavelengths, channels) on another grid, (grid, channels): linear between entries, zero outside."""
    curves = np.asarray(quantum_efficiency, dtype=np.float64).T
    return np.stack([np.interp(grid_nm, wavelengths_nm, curve, left=0.0, right=0.0) for curve in curves], axis=-1)
