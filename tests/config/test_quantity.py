"""Quantities are read as a photographer writes them, exactly, or refused with a hint."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator import units
from simulator.config.quantity import format_quantity, parse_quantity, split_quantity
from simulator.config.unit_words import COMMON_FACTORS, get_unit_registry

UNITS = {name: kind.__metadata__[0] for name, kind in vars(units).items() if hasattr(kind, "__metadata__")}


@pytest.mark.parametrize(
    ("text", "kind", "number"),
    [
        ("1/125 s", "Seconds", 0.008),
        ("1 / 125 s", "Seconds", 0.008),
        ("2 min", "Seconds", 120.0),
        ("20 ms", "Seconds", 0.02),
        ("50 mm", "Millimetres", 50.0),
        ("5 cm", "Millimetres", 50.0),
        ("4.3 um", "Micrometres", 4.3),
        ("4.3 µm", "Micrometres", 4.3),
        ("4.3\u03bcm", "Micrometres", 4.3),
        ("380 nm", "Nanometres", 380.0),
        ("10 ft", "Metres", 3.048),
        ("inf m", "Metres", math.inf),
        ("infinity", "Metres", math.inf),
        ("100 cd/m^2", "CandelasPerSquareMetre", 100.0),
        ("100 cd/m²", "CandelasPerSquareMetre", 100.0),
        ("100 nit", "CandelasPerSquareMetre", 100.0),
        ("40 deg", "Degrees", 40.0),
        ("3200 K", "Kelvins", 3200.0),
        ("40 degC", "Kelvins", 313.15),
        ("-20 °C", "Kelvins", 253.15),
        ("165963 e-", "Electrons", 165963.0),
        ("165963e-", "Electrons", 165963.0),
        ("1e-2 e-", "Electrons", 0.01),
        ("0.1 e-/s", "ElectronsPerSecond", 0.1),
        ("6 e-/min", "ElectronsPerSecond", 0.1),
        ("512 DN", "DigitalNumbers", 512.0),
        ("0.0956 DN/e-", "DigitalNumbersPerElectron", 0.0956),
        ("f/2.8", "FNumber", 2.8),
        ("F2.8", "FNumber", 2.8),
        (2.8, "FNumber", 2.8),
        ("T/3.1", "TStop", 3.1),
        ("t3.1", "TStop", 3.1),
        ("f/3.1", "TStop", 3.1),
        (3.1, "TStop", 3.1),
    ],
)
def test_a_photographers_notation_gives_the_number_in_the_fields_unit(text, kind, number):
    assert parse_quantity(text, UNITS[kind]) == pytest.approx(number, rel=1e-15)


@pytest.mark.parametrize(
    ("value", "kind", "message"),
    [
        (50, "Millimetres", "has no unit; write a length such as 50 mm"),
        (0.5, "Seconds", "write a time such as 0.5 s"),
        ("50", "Millimetres", "has no unit"),
        ("50 s", "Millimetres", "is a time; a length such as 50 mm is wanted here"),
        ("50 mm", "Seconds", "is a length; a time such as 1/125 s is wanted here"),
        ("40", "Degrees", "has no unit"),
        ("f/2.8", "Millimetres", "is an f-number"),
        ("4 mm", "FNumber", "is a length"),
        ("T/3.1", "FNumber", "is a T-stop; an f-number such as f/2.8 is wanted here"),
        ("T/3.1", "Millimetres", "is a T-stop"),
        ("4 mm", "TStop", "is a length; a T-stop such as T/3.1 is wanted here"),
        ("50 M", "Metres", "`M` is no unit known here"),
        ("50 parsec", "Metres", "`parsec` is no unit"),
        ("1,5 mm", "Millimetres", "decimal point"),
        ("inf s", "Seconds", "only a distance can be infinite"),
        ("1e999 m", "Metres", "too large"),
        ("1/0 s", "Seconds", "divides by zero"),
        ("nan m", "Metres", "is no quantity"),
        (math.nan, "FNumber", "f/2.8"),
        (True, "FNumber", "f/2.8"),
        (None, "Seconds", "1/125 s"),
        ("", "Seconds", "is no quantity"),
        ("5 5 mm", "Millimetres", "is no unit"),
        ("1" * 100 + " m", "Metres", "too long"),
    ],
)
def test_what_is_no_such_quantity_is_refused_with_what_to_write(value, kind, message):
    with pytest.raises(ValueError) as caught:
        parse_quantity(value, UNITS[kind])
    assert message in str(caught.value)


def test_a_conversion_that_overflows_is_refused():
    with pytest.raises(ValueError, match="too large"):
        parse_quantity("1e308 m", UNITS["Nanometres"])


@given(st.text(max_size=30), st.sampled_from(sorted(UNITS)))
def test_any_text_is_a_finite_number_or_a_value_error(text, kind):
    try:
        number = parse_quantity(text, UNITS[kind])
    except ValueError:
        return
    assert math.isfinite(number) or (kind == "Metres" and math.isinf(number))


@given(st.from_regex(r"[-+]?[0-9./e]{1,12} ?[a-zA-Z/^²µ°0-9* -]{0,12}", fullmatch=True), st.sampled_from(sorted(UNITS)))
def test_any_near_quantity_is_a_finite_number_or_a_value_error(text, kind):
    try:
        number = parse_quantity(text, UNITS[kind])
    except ValueError:
        return
    assert math.isfinite(number)


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(sorted(UNITS)))
def test_a_written_quantity_reads_back_to_the_same_float(number, kind):
    number = abs(number) if kind in ("FNumber", "TStop") else number
    assert parse_quantity(format_quantity(number, UNITS[kind]), UNITS[kind]) == number


def test_splitting_keeps_the_unit_as_written():
    assert split_quantity("1/4 s") == (0.25, "s")
    assert split_quantity("f/8") == (8.0, "f_number")
    assert split_quantity("T/8") == (8.0, "t_number")
    assert split_quantity("3") == (3.0, "")


@pytest.mark.parametrize(
    ("symbol", "text", "factor"), [(symbol, *entry) for symbol, entries in COMMON_FACTORS.items() for entry in entries.items()]
)
def test_the_factors_of_common_units_are_those_of_pint(symbol, text, factor):
    registry = get_unit_registry()
    given = registry.parse_units(text.replace("e-", "electron"))
    for number in np.random.default_rng(1).lognormal(0.0, 8.0, 200).tolist():
        assert float(registry.Quantity(number, given).m_as(registry.parse_units(symbol))) == number * factor
