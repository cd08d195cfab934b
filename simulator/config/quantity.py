"""Parse and format quantities as photographers write them: `1/125 s`, `f/2.8`, `4.3 um`, `100 cd/m^2`, `165963 e-`, `inf m`."""

import functools
import math
import re
from typing import TYPE_CHECKING

from simulator.config.unit_words import APERTURES, COMMON_FACTORS, SHORT, WORDS, get_unit_registry, name_quantity, write_example
from simulator.units import Unit

if TYPE_CHECKING:
    from pint import Unit as PintUnit

NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
QUANTITY = re.compile(
    rf"(?P<sign>[+-]?)\s*(?P<top>{NUMBER}|inf(?:inity)?\b|∞)(?:\s*/\s*(?P<bottom>{NUMBER}))?\s*(?P<unit>.*)", re.I
)
APERTURE = re.compile(rf"([ft])\s*/?\s*({NUMBER})", re.I)


def parse_quantity(value: object, unit: Unit) -> float:
    """Return the number of `unit` that a value of the configuration states.

    value: text such as `1/125 s`; a bare number only for an f-number or T-stop, which have no dimension. A T-stop
        may be written `f/4.2`, too.
    Raises ValueError, whose message says how to write it, for anything else; for NaN; and for infinity
    unless the unit is the metre, because only a distance can be infinite.
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
        if unit.symbol in APERTURES:
            return float(value)
        raise ValueError(f"has no unit; write {name_quantity(unit)} such as {format_quantity(value, unit)}")
    if not isinstance(value, str):
        raise ValueError(f"is not understood; write {name_quantity(unit)} such as {write_example(unit)}")
    return _parse_text(value.strip(), unit)


@functools.lru_cache(maxsize=4096)
def _parse_text(text: str, unit: Unit) -> float:
    number, unit_text = split_quantity(text)
    if math.isinf(number):
        if unit.symbol != "metre":
            raise ValueError(f"only a distance can be infinite; give {name_quantity(unit)} such as {write_example(unit)}")
        unit_text = unit_text or "m"
    if unit.symbol == "t_number" and unit_text == "f_number":
        return number
    if not unit_text:
        raise ValueError(f"has no unit; write {name_quantity(unit)} such as {write_example(unit)}")
    return convert(number, unit_text, unit.symbol, f"{name_quantity(unit)} such as {write_example(unit)}")


def split_quantity(text: str) -> tuple[float, str]:
    """Return number and unit text of a quantity; an f-number has the unit `f_number`, a T-stop `t_number`, a bare number ''.

    Raises ValueError when the text does not begin with a number.
    """
    text = text.strip()
    if len(text) > 60:
        raise ValueError("is too long for a quantity; write a number and a unit, such as 50 mm")
    if aperture := APERTURE.fullmatch(text):
        return float(aperture[2]), f"{aperture[1].lower()}_number"
    match = QUANTITY.fullmatch(text)
    if re.search(r"\d,\d", text):
        raise ValueError("holds a comma; write a decimal point, such as 1.5 mm")
    if not match:
        raise ValueError("is no quantity; write a number and a unit, such as 50 mm or 1/125 s")
    sign = -1.0 if match["sign"] == "-" else 1.0
    if match["top"][0] in "iI∞":
        return sign * math.inf, match["unit"]
    top, bottom = float(match["top"]), float(match["bottom"] or 1)
    if bottom == 0:
        raise ValueError("divides by zero")
    if math.isinf(top) or math.isinf(bottom):
        raise ValueError("is too large a number")
    return sign * top / bottom, match["unit"]


def convert(number: float, unit_text: str, symbol: str, wanted: str) -> float:
    """Convert a number of one unit to the unit `symbol`. Raises ValueError, which names `wanted`, where that is impossible."""
    factor = COMMON_FACTORS.get(symbol, {}).get(unit_text)
    if factor is not None and (math.isinf(number) or math.isfinite(number * factor)):
        return number * factor
    given, target = parse_unit(unit_text, wanted), parse_unit(symbol, wanted)
    if given.dimensionality != target.dimensionality:
        raise ValueError(f"is {_name_dimension(given)}; {wanted} is wanted here")
    if given == target:
        return number
    result = float(get_unit_registry().Quantity(number, given).m_as(target))
    if math.isinf(result) and math.isfinite(number):
        raise ValueError(f"is too large; give {wanted}")
    return result


def parse_unit(text: str, wanted: str) -> "PintUnit":
    """Return the unit that a text names. Raises ValueError, which names `wanted`, for one that is not known."""
    electrons = re.sub(r"(?<![A-Za-z])e[-−⁻](?![A-Za-z0-9])", "electron", text.replace("°C", "degC"))
    try:
        return get_unit_registry().parse_units(electrons)
    except Exception:  # pint raises tokenizer, attribute and value errors alike for text it cannot read
        raise ValueError(f"`{text}` is no unit known here; give {wanted}") from None


def _name_dimension(given: "PintUnit") -> str:
    for symbol, (name, _) in WORDS.items():
        if get_unit_registry().parse_units(symbol).dimensionality == given.dimensionality:
            return name
    return f"a quantity in {given:~}" if not given.dimensionless else "a bare number"


def format_quantity(number: float, unit: Unit) -> str:
    """Text that `parse_quantity` reads back to the same float."""
    if unit.symbol in APERTURES:
        return f"{APERTURES[unit.symbol]}{float(number)!r}".removesuffix(".0")
    if math.isinf(number):
        return "infinity" if number > 0 else "-inf m"
    return f"{float(number)!r}".removesuffix(".0") + f" {SHORT.get(unit.symbol, unit.symbol)}"


def join_quantity(number: float, unit_text: str) -> str:
    """Return the text that `split_quantity` splits into this number and this unit."""
    return format_quantity(number, Unit(unit_text, "")) if unit_text in APERTURES else f"{number!r} {unit_text}"
