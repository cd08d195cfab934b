"""Types that extend pydantic for the configuration: sections, quantities, and unions whose branch follows from the keys."""

import dataclasses
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Union

from pydantic import BaseModel, ConfigDict, Discriminator, GetCoreSchemaHandler, GetJsonSchemaHandler, Tag
from pydantic_core import CoreSchema, core_schema

from simulator.config.quantity import format_quantity, parse_quantity
from simulator.config.unit_words import APERTURES, name_quantity, write_example
from simulator.units import Unit


class Section(BaseModel):
    """A section of the configuration; `assemble` turns its values, by field name, into the simulator's object.

    A section without `assemble` stays as it is.
    """

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, arbitrary_types_allowed=True)
    assemble: ClassVar[Callable[..., object] | None] = None


@dataclasses.dataclass(frozen=True)
class Quantity:
    """Annotation with which pydantic parses text with a unit into a number, and writes the number as text."""

    unit: Unit

    def __get_pydantic_core_schema__(self, _source: Any, _handler: GetCoreSchemaHandler) -> CoreSchema:
        """Parse with the unit; serialise back to text."""
        return core_schema.no_info_plain_validator_function(
            lambda value: parse_quantity(value, self.unit),
            serialization=core_schema.plain_serializer_function_ser_schema(lambda value: format_quantity(value, self.unit)),
        )

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, _handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Text, with the unit and an example."""
        text = {
            "type": "string",
            "description": f"{name_quantity(self.unit)}, such as {write_example(self.unit)}",
            "examples": [write_example(self.unit)],
        }
        if self.unit.symbol in APERTURES:
            return {"anyOf": [text, {"type": "number", "exclusiveMinimum": 0}]}
        return text | {"pattern": r"^\s*[-+]?\s*([0-9.]|[iI]nf|∞)"}


def make_union(models: list[Any], hints: tuple[Any, ...]) -> Any:
    """Make a union that chooses a section by the keys of a mapping, and the plain type for any other value."""
    if type(None) in hints and len(hints) == 2:
        return models[0] | models[1]
    sections = {f"<{model.__name__}>": model for model in models if isinstance(model, type) and issubclass(model, Section)}
    plain = [model for model in models if model not in sections.values()]

    def branch(value: object) -> str:
        if isinstance(value, Section):
            return f"<{type(value).__name__}>"
        return find_best_section(sections, value) if isinstance(value, dict) and sections else "<plain>"

    tagged = [Annotated[model, Tag(name)] for name, model in sections.items()]
    if plain:
        tagged.append(Annotated[Union[tuple(plain)], Tag("<plain>")])  # noqa: UP007
    return Annotated[Union[tuple(tagged)], Discriminator(branch)]  # noqa: UP007


def find_best_section(sections: dict[str, type[Section]], value: dict[str, Any]) -> str:
    """Return the name of the section whose keys match a mapping best: the fewest keys are unknown or missing."""

    def misfits(model: type[Section]) -> int:
        known = {field.alias or name for name, field in model.model_fields.items()}
        wanted = {field.alias or name for name, field in model.model_fields.items() if field.is_required()}
        return len(set(value) - known) + len(wanted - set(value))

    return min(sections, key=lambda name: misfits(sections[name]))
