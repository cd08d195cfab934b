"""Combine documents: lay a camera over its base, set values by dotted path, find the files that sections name."""

from pathlib import Path
from typing import Any

from simulator.color.color_tables import CONFIGS
from simulator.config.document import Document, Keys, Place, absolute_path, parse_document
from simulator.errors import PhotositeError, why_no_file

MERGE = "merge"  # key in a table that lays it over the base's


def select_section(document: Document, key: str | int) -> Document:
    """Return the section `key` as a document of its own."""
    places = {keys[1:]: place for keys, place in document.places.items() if keys[:1] == (key,)}
    places.setdefault((), document.place((key,)))
    return Document(document.data[key], places)


def replace_section(document: Document, key: str | int, section: Document) -> Document:
    """Return a copy of the document whose section `key` is `section`."""
    places = {keys: place for keys, place in document.places.items() if keys[:1] != (key,)}
    places |= {(key,) + keys: place for keys, place in section.places.items()}
    if isinstance(document.data, list):
        return Document([section.data if index == key else item for index, item in enumerate(document.data)], places)
    return Document(document.data | {key: section.data}, places)


def merge(base: Document, over: Document) -> Document:
    """Lay `over` on `base`: mappings are merged, other values replace those of the base, null removes a key of the base.

    A table, whose keys are whole numbers, replaces that of the base: the lines of an `iso_table` were measured together. With
    `merge: true` in it, it is merged as any mapping.
    """
    if not (isinstance(base.data, dict) and isinstance(over.data, dict)):
        return over
    result = base
    for written, value in over.data.items():
        key, section = find_key(base.data, written), select_section(over, written)
        if value is None and key in base.data:
            result = remove_key(result, (key,))
        elif key not in base.data:
            result = replace_section(result, key, section)
        elif is_table(base.data[key]):
            result = replace_section(result, key, _merge_table(select_section(base, key), section))
        else:
            result = replace_section(result, key, merge(select_section(base, key), section))
    return result


def is_table(data: object) -> bool:
    """Whether a value is a mapping from whole numbers."""
    return isinstance(data, dict) and bool(data) and all(str(key).isdecimal() for key in data if key != MERGE)


def _merge_table(base: Document, over: Document) -> Document:
    """Return the table `over`, merged with the base's where it says so."""
    if not isinstance(over.data, dict) or MERGE not in over.data:
        return over
    wanted = over.data[MERGE]
    if not isinstance(wanted, bool):
        raise over.problem((MERGE,), "write true, or leave it out to replace the table of the base", wanted)
    over = remove_key(over, (MERGE,))
    return merge(base, over) if wanted else over


def find_key(mapping: dict[str | int, Any], key: str | int) -> str | int:
    """Return the key under which a mapping holds `key`; 100 and "100" are one key (JSON knows only text keys)."""
    if key in mapping:
        return key
    return next((known for known in mapping if str(known) == str(key)), key)


def remove_key(document: Document, keys: Keys) -> Document:
    """Return a copy of the document without one key."""
    first, *rest = keys
    if rest:
        return replace_section(document, first, remove_key(select_section(document, first), tuple(rest)))
    places = {known: place for known, place in document.places.items() if known[:1] != keys}
    return Document({key: value for key, value in document.data.items() if key != first}, places)


def replace_value(document: Document, dotted: str, value: object, place: Place) -> Document:
    """Return a copy of the document with the value at a dotted path set. Null removes the key; missing sections are added.

    An item of a list is named by its number from 0, as in scene.layers.0.depth.

    Raises PhotositeError, which names the place, for a path that runs through a plain value or removes nothing.
    """
    keys = tuple(dotted.split("."))
    if not all(keys):
        raise _problem(place, f"`{dotted}` is no key; write a dotted path such as lens.f_number")
    return _set(document, keys, value, place, dotted)


def _set(document: Document, keys: tuple[str, ...], value: object, place: Place, dotted: str) -> Document:
    rest = keys[1:]
    if isinstance(document.data, list):
        return _set_item(document, keys, value, place, dotted)
    if not isinstance(document.data, dict):
        raise _problem(place, f"`{document.data}` is a value, not a section; the path ends before it", dotted)
    key = find_key(document.data, keys[0])
    if rest:
        inner = select_section(document, key) if document.data.get(key) is not None else Document({}, {(): place})
        return replace_section(document, key, _set(inner, rest, value, place, dotted))
    if value is None:
        if key not in document.data:
            raise _problem(place, "is not there, so nothing is removed; leave it out", dotted, joint=" ")
        return remove_key(document, (key,))
    return replace_section(document, key, Document(value, {(): place}))


def _set_item(document: Document, keys: tuple[str, ...], value: object, place: Place, dotted: str) -> Document:
    """`_set` for a list."""
    count = len(document.data)
    if not keys[0].isdecimal() or int(keys[0]) >= count or (value is None and len(keys) == 1):
        fix = "write the whole list to change their number" if keys[0].isdecimal() else "name one by its number from 0"
        raise _problem(place, f"the list there has {count} items; {fix}", dotted)
    index = int(keys[0])
    inner = _set(select_section(document, index), keys[1:], value, place, dotted) if keys[1:] else Document(value, {(): place})
    return replace_section(document, index, inner)


def parse_override(text: str) -> tuple[str, object, Place]:
    """Split `path=value`, as `--set` takes it, into dotted path, plain value and place; its files are relative to this folder.

    Raises PhotositeError when there is no `=` or the value is broken YAML.
    """
    dotted, equals, value = text.partition("=")
    name = f"--set {text}"
    if not equals or not dotted.strip():
        raise PhotositeError("write path=value, such as --set lens.f_number=f/2.8", file=name)
    return dotted.strip(), parse_document(value, name, Path.cwd(), lines=False).data, Place(name, Path.cwd())


def named_file(kind: str, path: str | Path) -> Path:
    """Return the file that a user's `path` means: itself, or, for a bare name that is no file, that of configs/<kind>.

    Raises PhotositeError with the nearest name for a bare name that is neither.
    """
    given = Path(path)
    if given.suffix or "/" in str(path) or given.is_file():
        return given
    one = "study" if kind == "studies" else kind.removesuffix("s")
    return find_config(kind, str(path), Place(str(path), Path.cwd()), one)


def find_config(kind: str, name: str, place: Place, key: str) -> Path:
    """Return the file that `name` means: a name in configs/<kind>, such as illustrative/x_trans, or a path.

    A path is relative to the file that states it.

    Raises PhotositeError with the nearest name, and as `absolute_path` does.
    """
    from simulator.config.messages import suggest_nearest

    shipped = CONFIGS / kind / f"{name}.yaml"
    if not Path(name).is_absolute() and not {".", ".."} & set(name.split("/")) and shipped.is_file():
        return shipped
    if "/" in name or name.endswith((".yaml", ".yml", ".json", ".csv", ".xml")):
        path = absolute_path(name, place, key)
        if path.is_file():
            return path
        raise _problem(place, f"{why_no_file(path)}: {path}; a path is relative to the file that names it", key, name)
    raise _problem(place, f"no such file in configs/{kind}; {suggest_nearest(name, shipped_names(kind))}", key, name)


def shipped_names(kind: str) -> list[str]:
    """Return the names of the files in configs/<kind>, such as shots or cameras, in alphabetical order."""
    return sorted(path.stem for path in (CONFIGS / kind).glob("*.yaml"))


def _problem(place: Place, rule: str, key: str | None = None, value: object = None, joint: str = ": ") -> PhotositeError:
    return PhotositeError(rule, key=key, value=value, joint=joint).with_file(place.file, place.line, place.via)
