"""Speeds of things in the scene in YAML: `120 px/s`, `1.5 m/s`, `5 px/frame`; the unit chooses what the number means."""

import dataclasses
from typing import Annotated, Any, get_args

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from simulator.config.dataclass_sections import CUSTOM_TEXTS
from simulator.config.quantity import convert, parse_unit, split_quantity
from simulator.exposure.object_motion import Speed, SpeedUnit

WANTED = "a speed with its unit, such as 120 px/s, 1.5 m/s or 5 px/frame"
SYMBOLS: dict[SpeedUnit, str] = {
    "px/s": "pixel / second",
    "m/s": "metre / second",
    "px/frame": "pixel / frame",
    "m/frame": "metre / frame",
}


def parse_speed(value: object) -> Speed:
    """Return the speed that a value of the configuration states. Raises ValueError, which says how to write it."""
    if isinstance(value, Speed):
        return value
    if not isinstance(value, str):
        fault = "has no unit" if isinstance(value, int | float) and not isinstance(value, bool) else "is not understood"
        raise ValueError(f"{fault}; write {WANTED}")
    number, unit_text = split_quantity(value)
    if not unit_text:
        raise ValueError(f"has no unit; write {WANTED}")
    if unit_text in get_args(SpeedUnit):
        return Speed(number, next(unit for unit in SYMBOLS if unit == unit_text))
    given = parse_unit(unit_text, WANTED)
    for unit, symbol in SYMBOLS.items():
        if parse_unit(symbol, WANTED).dimensionality == given.dimensionality:
            return Speed(convert(number, unit_text, symbol, WANTED), unit)
    raise ValueError(f"`{unit_text}` is no unit of a speed; write {WANTED}")


def format_speed(speed: Speed) -> str:
    """Return the text that `parse_speed` reads back to the same speed."""
    return f"{speed.value!r}".removesuffix(".0") + f" {speed.unit}"


@dataclasses.dataclass(frozen=True)
class SpeedText:
    """Annotation with which pydantic parses text into a speed, and writes it as text."""

    def __get_pydantic_core_schema__(self, _source: Any, _handler: GetCoreSchemaHandler) -> CoreSchema:
        """Parse; serialise back to text."""
        return core_schema.no_info_plain_validator_function(
            parse_speed, serialization=core_schema.plain_serializer_function_ser_schema(format_speed)
        )

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, _handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Text, with the unit and an example."""
        return {"type": "string", "description": WANTED, "pattern": r"^\s*[-+]?\s*[0-9.]", "examples": ["120 px/s", "1.5 m/s"]}


CUSTOM_TEXTS[Speed] = Annotated[Speed, SpeedText()]
