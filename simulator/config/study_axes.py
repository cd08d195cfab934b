"""What a study varies: axes, and how they are combined: every combination of them (Product), or side by side (Zip).

An entry of `vary:` is a mapping whose items are walked side by side. An item is a dotted key with its values, named variants, a
`group`, which holds a list as `vary:` does, or a `zip`, which holds a list whose entries are walked side by side.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from simulator.config.document import Document, Place
from simulator.config.document_merge import select_section
from simulator.config.shot_file import Setting
from simulator.config.study_values import expand_study_values
from simulator.config.sweep import SENSOR_KEYS
from simulator.config.sweep_section import check_count

CHECKED_OF_LIST, CHECKED = 500, 50  # values of an axis that are tried before a run: of a list, and of computed ones
# Columns of the table of results that no axis may have the name of.
RESERVED = ("index", "name", "state", "error", "command", "seconds", "predicted_error_sigma", "predicted_seconds")
VARIANTS, GROUP, ZIP = "variants", "group", "zip"


class Node(Protocol):
    """A part of what a study varies: so many rows, each of which sets a row of every axis in it."""

    def __len__(self) -> int: ...

    @property
    def axes(self) -> "list[Axis]":
        """Axes in the order of the file."""
        ...

    def rows(self, index: int) -> dict[str, int]:
        """Return the row of each axis, by its key."""
        ...

    def find(self, key: str, row: int) -> Iterator[int]:
        """Yield some indices with a row of an axis, those with the first, last and middle rows of other axes."""
        ...


@dataclass(frozen=True)
class Axis:
    """One varied key.

    key: dotted key of the shot, or the name of an axis of variants. values: as written, or the names of the variants.
    variants: settings of each variant; None: the value itself is set. place: where the values were written.
    """

    key: str
    values: Sequence[Any]
    place: Place
    variants: tuple[tuple[Setting, ...], ...] | None = None

    def __len__(self) -> int:
        return len(self.values)

    @property
    def axes(self) -> "list[Axis]":
        """Itself."""
        return [self]

    def rows(self, index: int) -> dict[str, int]:
        """Return the index, under the own key."""
        return {self.key: index}

    def find(self, key: str, row: int) -> Iterator[int]:
        """Yield the row."""
        yield row

    def to_check(self) -> Iterable[int]:
        """Return the rows whose values are tried before a run: all, or some with the first and the last."""
        most = CHECKED_OF_LIST if isinstance(self.values, list) else CHECKED
        return range(len(self)) if len(self) <= most else sorted({i * (len(self) - 1) // (most - 1) for i in range(most)})

    def settings(self, row: int) -> tuple[Setting, ...]:
        """Return what a row sets."""
        return ((self.key, self.values[row], self.place),) if self.variants is None else self.variants[row]

    @property
    def keeps_light(self) -> bool:
        """Whether points that differ in this axis alone have the same light on the sensor."""
        if self.variants is None:
            return self.key.startswith(SENSOR_KEYS)
        return all(key.startswith(SENSOR_KEYS) for row in self.variants for key, _, _ in row)


@dataclass(frozen=True)
class Product:
    """Every combination of its parts; the last one varies fastest."""

    parts: tuple[Node, ...]

    def __len__(self) -> int:
        return math.prod(len(part) for part in self.parts)

    @property
    def axes(self) -> list[Axis]:
        """Those of the parts."""
        return [axis for part in self.parts for axis in part.axes]

    def rows(self, index: int) -> dict[str, int]:
        """Return the rows of all parts at an index."""
        found: dict[str, int] = {}
        for part in reversed(self.parts):
            index, row = divmod(index, len(part))
            found = part.rows(row) | found
        return found

    def find(self, key: str, row: int) -> Iterator[int]:
        """Yield some indices with a row of an axis."""
        own = next(place for place, part in enumerate(self.parts) if any(axis.key == key for axis in part.axes))
        for found in self.parts[own].find(key, row):
            for share in (0.0, 1.0, 0.5):
                index = 0
                for place, part in enumerate(self.parts):
                    index = index * len(part) + (found if place == own else int(share * (len(part) - 1)))
                yield index


@dataclass(frozen=True)
class Zip:
    """Parts of the same length, walked side by side."""

    parts: tuple[Node, ...]

    def __len__(self) -> int:
        return len(self.parts[0])

    @property
    def axes(self) -> list[Axis]:
        """Those of the parts."""
        return [axis for part in self.parts for axis in part.axes]

    def rows(self, index: int) -> dict[str, int]:
        """Return the rows of all parts at an index."""
        return {key: row for part in self.parts for key, row in part.rows(index).items()}

    def find(self, key: str, row: int) -> Iterator[int]:
        """Yield some indices with a row of an axis."""
        return next(part.find(key, row) for part in self.parts if any(axis.key == key for axis in part.axes))


def read_vary(section: Document) -> Product:
    """Return what a `vary:` list states. Raises PhotositeError with the line."""
    product = _read_group(section, "vary")
    seen: set[str] = set()
    for axis in product.axes:
        if axis.key in RESERVED:
            raise section.problem((), f"{axis.key} is a column of the results; give the axis another name", key="vary")
        if axis.key in seen:
            raise section.problem((), "is varied twice; keep one of them", key=axis.key)
        seen.add(axis.key)
    return product


def dimensions(node: Product) -> list[Node]:
    """Return the parts whose combinations are the points, products inside the product opened."""
    return [inner for part in node.parts for inner in (dimensions(part) if isinstance(part, Product) else [part])]


def _read_list(section: Document, name: str) -> list[Node]:
    if not isinstance(section.data, list) or not section.data:
        rule = "give a list of entries, such as [{exposure.iso: [100, 400]}]"
        raise section.problem((), rule, key=name)
    return [_read_entry(select_section(section, index), name) for index in range(len(section.data))]


def _read_group(section: Document, name: str) -> Product:
    parts = tuple(_read_list(section, name))
    try:
        check_count(math.prod(len(part) for part in parts))
    except ValueError as error:
        raise section.problem((), f"{error}", key=name) from None
    return Product(parts)


def _read_entry(entry: Document, name: str) -> Node:
    """Return the node of an entry: that of its only item, or its items side by side."""
    if not isinstance(entry.data, dict) or not entry.data:
        rule = "an entry is a mapping, such as {exposure.iso: [100, 400]}"
        raise entry.problem((), rule, key=name, value=entry.data)
    return _side_by_side([_read_item(select_section(entry, key), str(key)) for key in entry.data], entry, name)


def _side_by_side(parts: list[Node], section: Document, name: str) -> Node:
    if len(parts) == 1:
        return parts[0]
    if len({len(part) for part in parts}) > 1:
        told = ", ".join(f"{' x '.join(axis.key for axis in part.axes)} has {len(part)}" for part in parts)
        raise section.problem((), f"what stands side by side needs as many values each, but {told}", key=name)
    return Zip(tuple(parts))


def _read_item(section: Document, key: str) -> Node:
    if key == GROUP:
        return _read_group(section, GROUP)
    if key == ZIP:
        return _side_by_side(_read_list(section, ZIP), section, ZIP)
    if key == VARIANTS:
        return _read_variants(section, key)
    if isinstance(section.data, dict) and VARIANTS in section.data:
        others = [str(one) for one in section.data if one != VARIANTS]
        if others:
            raise section.problem((others[0],), "stands beside variants; leave it out", key=f"{key}.{others[0]}")
        return _read_variants(select_section(section, VARIANTS), key)
    values = expand_study_values(section, key)
    if isinstance(values, list):
        for value in _find_repeated(values):
            rule = "stands there twice; for more frames of one setting vary seeds.frame, too"
            raise section.problem((), rule, key=key, value=value)
    return Axis(key, values, section.place(()))


def _find_repeated(values: Sequence[object]) -> Iterator[object]:
    """Yield the values that equal an earlier one; plain ones, of which there can be a million, are looked up by their hash."""
    plain: set[object] = set()
    sections: list[object] = []
    for value in values:
        is_section = isinstance(value, dict | list)
        if value in (sections if is_section else plain):
            yield value
        elif is_section:
            sections.append(value)
        else:
            plain.add(value)


def _read_variants(section: Document, key: str) -> Axis:
    """Return the axis of a mapping from names to settings."""
    if not isinstance(section.data, dict) or not section.data:
        rule = "give a mapping of names to settings, such as {wide: {lens.f_number: f/2}, small: {lens.f_number: f/8}}"
        raise section.problem((), rule, key=key)
    rows = []
    for name, settings in section.data.items():
        if not (settings is None or isinstance(settings, dict)):
            rule = "a variant is a mapping of dotted keys to values, such as {lens.f_number: f/2}"
            raise section.problem((name,), rule, settings, key=f"{key}.{name}")
        rows.append(tuple((str(one), value, section.place((name, one))) for one, value in (settings or {}).items()))
    return Axis(key, [str(name) for name in section.data], section.place(()), tuple(rows))
