"""Units of the configuration: definitions, names in messages, and how they are written.

The registry is small on purpose: it holds these units and nothing else, so that every dimension has a name in an
error message, `50 M` is no megametre, and an angle is not taken for a bare number.
"""

import functools
from typing import TYPE_CHECKING, Any

from simulator.units import Unit

if TYPE_CHECKING:
    from pint import UnitRegistry

DEFINITIONS = """
nano- = 1e-9 = n-
micro- = 1e-6 = µ- = μ- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
metre = [length] = m = meter
inch = 0.0254 * metre = in = inches
foot = 0.3048 * metre = ft = feet
second = [time] = s = sec
minute = 60 * second = min
hour = 3600 * second = h
hertz = 1 / second = Hz
joule = [energy] = J
watt = joule / second = W
kelvin = [temperature] = K
degree_Celsius = kelvin; offset: 273.15 = degC
candela = [luminosity] = cd
nit = candela / metre ** 2
radian = [angle] = rad
degree = 0.017453292519943295 * radian = deg = °
electron = [electron]
DN = [code] = LSB = ADU
pixel = [pixel] = px
frame = [frame]
f_number = [f_number]
t_number = [t_number]
"""

# Name and example of a quantity, by the unit in which the field holds it.
WORDS = {
    "second": ("a time", "1/125 s"),
    "metre": ("a length", "2.5 m"),
    "millimetre": ("a length", "50 mm"),
    "micrometre": ("a length", "4.3 um"),
    "nanometre": ("a length", "550 nm"),
    "degree": ("an angle", "40 deg"),
    "degree / second": ("a speed of rotation", "10 deg/s"),
    "metre / second": ("a speed", "1.5 m/s"),
    "metre / second**2": ("an acceleration", "900 m/s^2"),
    "hertz": ("a frequency", "100 Hz"),
    "pixel / second": ("a speed on the scene", "120 px/s"),
    "pixel / frame": ("a speed on the scene per frame", "5 px/frame"),
    "metre / frame": ("a speed per frame", "0.1 m/frame"),
    "joule": ("an energy", "20 J"),
    "watt / metre**2": ("an irradiance", "0.1 W/m^2"),
    "kelvin": ("a temperature", "5500 K"),
    "candela / metre**2": ("a luminance", "100 cd/m^2"),
    "electron": ("a number of electrons", "50000 e-"),
    "electron / second": ("electrons per time", "0.1 e-/s"),
    "DN": ("a raw level", "512 DN"),
    "DN / electron": ("a gain", "0.1 DN/e-"),
    "f_number": ("an f-number", "f/2.8"),
    "t_number": ("a T-stop", "T/3.1"),
}
SHORT = {
    "second": "s",
    "metre": "m",
    "millimetre": "mm",
    "micrometre": "um",
    "nanometre": "nm",
    "degree": "deg",
    "degree / second": "deg/s",
    "metre / second": "m/s",
    "metre / second**2": "m/s^2",
    "hertz": "Hz",
    "joule": "J",
    "watt / metre**2": "W/m^2",
    "kelvin": "K",
    "candela / metre**2": "cd/m^2",
    "electron": "e-",
    "electron / second": "e-/s",
    "DN": "DN",
    "DN / electron": "DN/e-",
}
APERTURES = {"f_number": "f/", "t_number": "T/"}  # numbers without a dimension, and what is written before them
# Factors of the units that photographers write, by the unit that the field holds: pint knows all others and what they are
# worth together, and takes a fifth of a second to import.
COMMON_FACTORS = {
    "second": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "metre": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "millimetre": {"mm": 1.0, "cm": 10.0, "um": 1e-3},
    "micrometre": {"um": 1.0, "mm": 1e3},
    "nanometre": {"nm": 1.0},
    "degree": {"deg": 1.0},
    "degree / second": {"deg/s": 1.0},
    "metre / second": {"m/s": 1.0, "km/h": 1.0 / 3.6},
    "metre / second**2": {"m/s^2": 1.0},
    "hertz": {"Hz": 1.0, "kHz": 1e3},
    "joule": {"J": 1.0, "mJ": 1e-3},
    "watt / metre**2": {"W/m^2": 1.0, "uW/cm^2": 1e-2},
    "kelvin": {"K": 1.0},
    "candela / metre**2": {"cd/m^2": 1.0},
    "electron": {"e-": 1.0},
    "electron / second": {"e-/s": 1.0},
    "DN": {"DN": 1.0},
    "DN / electron": {"DN/e-": 1.0},
    "f_number": {"f_number": 1.0},
    "t_number": {"t_number": 1.0},
}


@functools.cache
def get_unit_registry() -> "UnitRegistry[Any]":
    """Return the pint registry with DEFINITIONS, made once."""
    from pint import UnitRegistry

    empty: Any = None  # pint reads this as "no definitions"; its annotation names only files of definitions
    registry: UnitRegistry[Any] = UnitRegistry(empty)
    for line in DEFINITIONS.strip().splitlines():
        registry.define(line)
    return registry


def write_example(unit: Unit) -> str:
    """Return an example of a quantity in this unit, such as `50 mm`."""
    return WORDS.get(unit.symbol, ("", f"1 {unit.symbol}"))[1]


def name_quantity(unit: Unit) -> str:
    """Return what a quantity in this unit is called, such as `a length`."""
    return WORDS.get(unit.symbol, (f"a quantity in {unit.symbol}", ""))[0]
