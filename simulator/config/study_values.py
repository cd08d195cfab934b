"""The values of one varied key of a study: a list, steps between two ends, whole numbers, or random draws."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field

from simulator.config.build import validate
from simulator.config.distributions import Distribution, LogUniform, Normal, Uniform, draw
from simulator.config.document import Document
from simulator.config.quantity import convert, join_quantity, split_quantity
from simulator.config.random_streams import LARGEST_SEED, RandomStream
from simulator.config.section_types import Section
from simulator.config.sweep_section import Number, Steps, WholeNumbers, expand_values, split_number
from simulator.errors import PhotositeError

STEP_ERROR = 1e-6  # share of a step by which the last value may miss the end
MOST_VALUES = 1_000_000


class Range(Section):
    """Values from one end to the other, both included, by their number or by their distance."""

    first: Annotated[Number, Field(alias="from", description="first value")]
    last: Annotated[Number, Field(alias="to", description="last value")]
    steps: Annotated[int | None, Field(ge=2, le=MOST_VALUES, description="number of values")] = None
    scale: Annotated[Literal["linear", "log2"], Field(description="of `steps`; log2: equal ratios")] = "linear"
    step: Annotated[Number | None, Field(description="distance of the values")] = None
    log2_step: Annotated[float | None, Field(description="distance in stops: 1 doubles, 0.5 takes two values a stop")] = None


class RandomDraws(Section):
    """Values drawn at random. Value i follows from seed, key and i alone, so that a larger count keeps those drawn before."""

    random: Annotated[Literal["uniform", "log_uniform", "normal"], Field(description="distribution")]
    count: Annotated[int, Field(ge=1, le=MOST_VALUES, description="number of values")]
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED, description="other seeds draw other values")] = 0
    first: Annotated[Number | None, Field(alias="from", description="least value")] = None
    last: Annotated[Number | None, Field(alias="to", description="greatest value")] = None
    mean: Annotated[Number | None, Field(description="of normal")] = None
    sigma: Annotated[Number | None, Field(description="standard deviation of normal")] = None
    whole: Annotated[bool, Field(description="round to whole numbers")] = False


def expand_study_values(section: Document, key: str) -> Sequence[Any]:
    """Return the values of one varied key; those of steps are made when they are asked for.

    section: what the study file states for the key. Raises PhotositeError with the line.
    """
    data = section.data
    if isinstance(data, list) and data:
        return data
    if not isinstance(data, dict):
        rule = "give a list of values, {from: A, to: B, steps: N}, or {random: uniform, from: A, to: B, count: N}"
        raise section.problem((), rule, key=key, value=None if data == [] else data)
    try:
        if "random" in data:
            return _draw(validate(RandomDraws, section), key)
        if "range" in data:
            return expand_values(validate(WholeNumbers, section))
        return expand_values(_count_steps(validate(Range, section)))
    except ValueError as wrong:
        raise section.problem((), f"{wrong}", key=key) from None
    except PhotositeError as error:
        named = error.replace(key=key if error.key is None else f"{key}.{error.key}")
        raise (named if named.file else section.locate_error(named, ())) from None


def _count_steps(given: Range) -> Steps:
    """Return the steps of a range. Raises ValueError where they do not lead to its end."""
    ways = [one for one in (given.steps, given.step, given.log2_step) if one is not None]
    if len(ways) != 1:
        raise ValueError("give one of steps, step and log2_step")
    scale: Literal["linear", "log2"] = "linear" if given.log2_step is None else "log2"
    if given.steps is not None:
        count, scale = given.steps, given.scale
    else:
        first, last = _in_unit_of(given.first, given.first), _in_unit_of(given.last, given.first)
        if given.log2_step is not None:
            if not (0.0 < first and 0.0 < last < math.inf and given.log2_step > 0.0):
                raise ValueError("equal ratios need both ends above 0, and a log2_step above 0")
            intervals = abs(math.log2(last) - math.log2(first)) / given.log2_step
        else:
            distance = _in_unit_of(given.step, given.first)
            if distance <= 0.0 or not math.isfinite(last - first):
                raise ValueError("give a step above 0 and finite ends; the ends say in which direction it goes")
            intervals = abs(last - first) / distance
        told = f"{intervals:.6g} steps lead from one end to the other"
        if not intervals <= MOST_VALUES:
            raise ValueError(f"{told}; {MOST_VALUES} values are possible, so give a larger step")
        count = round(intervals) + 1
        if abs(intervals - round(intervals)) > STEP_ERROR or not 2 <= count <= MOST_VALUES:
            raise ValueError(f"{told}; give ends that a whole number of steps joins")
    return Steps.model_validate({"from": given.first, "to": given.last, "steps": count, "scale": scale})


def _draw(given: RandomDraws, key: str) -> list[Number]:
    """Return the values drawn. Raises ValueError for ends that do not fit, PhotositeError for those of no distribution."""
    wanted = ("mean", "sigma") if given.random == "normal" else ("first", "last")
    missing = [{"first": "from", "last": "to"}.get(name, name) for name in wanted if getattr(given, name) is None]
    if missing:
        raise ValueError(f"{given.random} needs {' and '.join(missing)}")
    if given.random != "normal" and (given.mean is not None or given.sigma is not None):
        raise ValueError(f"mean and sigma belong to normal, not to {given.random}")
    like = given.mean if given.random == "normal" else given.first
    unit = split_quantity(like)[1] if isinstance(like, str) else ""
    ends = (given.first, given.last)
    if (given.first is None) != (given.last is None):
        raise ValueError("give both from and to, or neither")
    within = None if ends[0] is None else (_in_unit_of(ends[0], like), _in_unit_of(ends[1], like))
    distribution: Distribution
    if given.random == "normal":
        distribution = Normal((_in_unit_of(given.mean, like), _in_unit_of(given.sigma, like)), within)
    else:
        low_high = _in_unit_of(given.first, like), _in_unit_of(given.last, like)
        distribution = Uniform(low_high) if given.random == "uniform" else LogUniform(low_high)
    values = [draw(distribution, RandomStream(given.seed, index).uniform(key)) for index in range(given.count)]
    if not all(map(math.isfinite, values)):
        raise ValueError("the ends lie too far apart to draw numbers between them; give nearer ones")
    return [_write(round(value) if given.whole else value, unit) for value in values]


def _in_unit_of(value: Number | None, like: Number | None) -> float:
    """Return the number of a value in the unit of another one. Raises ValueError where that is impossible."""
    number, unit = split_number(0.0 if value is None else value)
    wanted = split_quantity(like)[1] if isinstance(like, str) else ""
    if bool(unit) != bool(wanted):
        raise ValueError("give all of them a unit, or none")
    return number if unit == wanted else convert(number, unit, wanted, f"a quantity in {wanted}")


def _write(value: float, unit: str) -> Number:
    """Return a number as a study file would state it in a unit."""
    return join_quantity(value, unit) if unit else value
