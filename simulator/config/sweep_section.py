"""The `sweep:` section: which keys vary, over which values."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal, overload

from pydantic import Discriminator, Field, Tag

from simulator.config.quantity import convert, join_quantity, parse_unit, split_quantity
from simulator.config.section_types import Section
from simulator.config.series_section import SeriesSection

Number = int | float | str
MOST_POINTS = 10_000_000  # of a sweep or a study, and whole numbers of one key
DIGITS_TOLD = 18  # a longer number of points is not written out


class Steps(Section):
    """Values from one end to the other, both included."""

    first: Annotated[Number, Field(alias="from", description="first value")]
    last: Annotated[Number, Field(alias="to", description="last value")]
    steps: Annotated[int, Field(ge=2, le=1_000_000, description="number of values")]
    scale: Annotated[Literal["linear", "log2"], Field(description="log2: equal ratios, that is equal stops")] = "linear"


class WholeNumbers(Section):
    """Whole numbers as Python's range(first, stop, step): the stop is left out."""

    range: Annotated[list[int], Field(min_length=2, max_length=3, description="[first, stop] or [first, stop, step]")]


def _find_form(value: object) -> str:
    if isinstance(value, (Steps, WholeNumbers)):
        return f"<{type(value).__name__}>"
    if isinstance(value, dict):
        return "<WholeNumbers>" if "range" in value else "<Steps>"
    return "<list>"


Values = Annotated[
    Annotated[list[Any], Field(min_length=1), Tag("<list>")]
    | Annotated[Steps, Tag("<Steps>")]
    | Annotated[WholeNumbers, Tag("<WholeNumbers>")],
    Discriminator(_find_form),
]


class SweepSection(Section):
    """Points of a sweep: each sets the varied keys and is taken as a shot of its own, or as a series of frames."""

    mode: Annotated[Literal["product", "zip"], Field(description="every combination, or value by value")] = "product"
    vary: Annotated[dict[str, Values], Field(description="dotted key -> values")] = {}
    series: Annotated[SeriesSection | None, Field(description="frames taken one after the other at every point")] = None
    same_noise: Annotated[
        bool, Field(description="use seeds.frame as it is at every point; otherwise the point's index is added")
    ] = False


class EvenSteps(Sequence[Number]):
    """The values of `Steps`, each computed when it is asked for.

    Raises ValueError for unknown units, ends of different dimension, infinite ends and those whose distance or ratio no float
    holds, and ends of a log2 scale that are not above 0.
    """

    def __init__(self, steps: Steps):
        self.steps, self.log, self.ends = steps.steps, steps.scale == "log2", (steps.first, steps.last)
        self.first, self.unit = split_number(steps.first)
        self.last, unit = split_number(steps.last)
        if bool(self.unit) != bool(unit):
            raise ValueError("give both ends a unit, or neither")
        for name in filter(None, (self.unit, unit)):
            parse_unit(name, "a quantity such as 50 mm or 1/125 s")
        if unit != self.unit:
            self.last = convert(self.last, unit, self.unit, f"a quantity in {self.unit}")
        if self.log and not (self.first > 0 and self.last > 0):
            raise ValueError("equal ratios (scale: log2) need both ends above 0")
        if self.first in (float("inf"), float("-inf")) or self.last in (float("inf"), float("-inf")):
            raise ValueError("no even steps lead to infinity; list the values")
        if not math.isfinite(self.last - self.first) or (self.log and not 0.0 < self.last / self.first < math.inf):
            raise ValueError("the ends lie too far apart for even steps; list the values")
        self.whole = isinstance(steps.first, int) and isinstance(steps.last, int)

    def __len__(self) -> int:
        return self.steps

    @overload
    def __getitem__(self, index: int) -> Number: ...
    @overload
    def __getitem__(self, index: slice) -> list[Number]: ...
    def __getitem__(self, index: int | slice) -> Number | list[Number]:
        if isinstance(index, slice):
            return [self[place] for place in range(*index.indices(len(self)))]
        if not 0 <= index < self.steps:
            raise IndexError(index)
        if index in (0, self.steps - 1):
            return self.ends[index > 0]
        share = index / (self.steps - 1)
        if self.log:
            value = self.first * (self.last / self.first) ** share
        else:
            value = self.first + (self.last - self.first) * share
        value = float(f"{value:.12g}")  # 0.1 * 3 should read 0.3 in a file
        if self.unit:
            return join_quantity(value, self.unit)
        return int(value) if self.whole and value == int(value) else value


def split_number(value: Number) -> tuple[float, str]:
    """Return number and unit of a value, '' for a bare number. Raises ValueError for what is no quantity or too large."""
    try:
        return split_quantity(value) if isinstance(value, str) else (float(value), "")
    except OverflowError:
        raise ValueError("is too large a number; give a smaller one") from None


def check_count(count: int, what: str = "points") -> None:
    """Raise ValueError for more points, or values of one key, than are possible."""
    if count > MOST_POINTS:
        told = f"{count}" if count <= 10**DIGITS_TOLD else f"more than 10^{DIGITS_TOLD}"
        raise ValueError(f"gives {told} {what}; {MOST_POINTS} are possible, so give fewer values")


def expand_values(values: list[Any] | Steps | WholeNumbers) -> Sequence[Any]:
    """Return the values of one varied key; computed ones are made when they are asked for.

    Raises ValueError for none, and for more than are possible.
    """
    if isinstance(values, Steps):
        return EvenSteps(values)
    if isinstance(values, WholeNumbers):
        if values.range[2:] == [0]:
            raise ValueError("a range cannot step by 0")
        if not (numbers := range(*values.range)):
            raise ValueError(f"the range {values.range} is empty; its stop is left out, as in Python")
        check_count((numbers[-1] - numbers[0]) // numbers.step + 1, "values")  # len() holds no more than 64 bits
        return numbers
    return values
