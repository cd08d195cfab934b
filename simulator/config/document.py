"""Read YAML into plain data, with the file and line of every key."""

import functools
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from simulator.color.color_tables import CONFIGS
from simulator.config.yaml_dialect import LibraryLoader, PlainLoader
from simulator.errors import PhotositeError, place_text, reading, why_no_file
from simulator.progress import counted_as

Keys = tuple[str | int, ...]  # from the top of a document to a value: keys of mappings and numbers of list items
MAX_NODES = 1_000_000  # limits nested aliases, which could otherwise expand exponentially


@dataclass(frozen=True)
class Place:
    """Where a value was written.

    file: path of the file, or the setting as it was given, such as `--set lens.f_number=2`.
    folder: folder that relative paths in the value start from.
    line: line of the file, from 1.
    via: section that sets another key to the value: `sweep`.
    below: number of cameras that are laid over the one whose response has the value; 0 for what is no base's.
    """

    file: str
    folder: Path
    line: int | None = None
    via: str | None = None
    below: int = 0

    @property
    def text(self) -> str:
        """How a message names the place."""
        return place_text(self.file, self.line, self.via)


@dataclass
class Document:
    """The contents of a YAML file, and where each of its keys was written.

    data: None, a bool, number or text, or lists and mappings of these. Whoever reads it checks which of them it is.
    places: by the keys that lead to a value from the top of the document; () is the file itself.
    """

    data: Any
    places: dict[Keys, Place] = field(default_factory=dict)

    def place(self, keys: Keys) -> Place:
        """Return the place of a key, or of the innermost section around it that has one; 100 and "100" are one key."""
        if keys in self.places:
            return self.places[keys]
        by_text = {tuple(map(str, known)): place for known, place in self.places.items()}
        texts = tuple(map(str, keys))
        return next(by_text[texts[:length]] for length in range(len(texts), -1, -1) if texts[:length] in by_text)

    def problem(self, keys: Keys, rule: str, value: object = None, *, key: str | None = None) -> PhotositeError:
        """Return an error with file and line. key: how the message names the key; by default the keys joined by points."""
        return self.locate_error(PhotositeError(rule, key=join_keys(keys) if key is None else key, value=value), keys)

    def locate_error(self, error: PhotositeError, keys: Keys) -> PhotositeError:
        """Return the error with the file and line of a key added."""
        place = self.place(keys)
        return error.with_file(place.file, place.line, place.via)


def join_keys(keys: Keys) -> str:
    """Return how messages name a key of a document: `scene.layers.0.image`."""
    return ".".join(map(str, keys))


def absolute_path(path: str | Path, place: Place, key: str) -> Path:
    """Return a path that a user wrote, from the folder of its place; `~` and `~name` are the home of a user.

    Raises PhotositeError, which names key and place, for a home that is not known.
    """
    try:
        return (place.folder / Path(path).expanduser()).absolute()
    except RuntimeError:
        rule = "begins with the home of a user who is not known here; write the whole path"
        raise PhotositeError(rule, key=key, value=path).with_file(place.file, place.line, place.via) from None


@counted_as("files")
def read_document(path: str | Path) -> Document:
    """Read a YAML file.

    Raises PhotositeError with file and line for a missing file, broken YAML, a key written twice, a tag, or
    anything but one mapping at the top.
    """
    path = Path(path).absolute()
    try:
        stat = path.stat()
        return _read_cached(path, stat.st_mtime_ns, stat.st_size)
    except OSError as error:
        is_none = isinstance(error, FileNotFoundError | IsADirectoryError)
        reason = why_no_file(path) if is_none else error.strerror
        raise PhotositeError(f"{reason}; give the path of a YAML file", file=path) from None


@functools.lru_cache(maxsize=64)
def _read_cached(path: Path, _modified: int, _size: int) -> Document:
    # Documents are never changed in place, so all points of a sweep can share one.
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        raise PhotositeError("not UTF-8 text; a shot or camera is a YAML file", file=path) from None
    document = parse_document(text, str(path), path.parent, is_ours=CONFIGS in path.parents)
    if not isinstance(document.data, dict):
        found = "empty" if document.data is None else f"a {type(document.data).__name__}"
        raise PhotositeError(f"the file is {found}; it must hold `key: value` lines, such as `lens: ...`", file=path)
    return document


def parse_document(text: str, name: str, folder: Path, lines: bool = True, is_ours: bool = False) -> Document:
    """Parse a YAML text. Messages begin with `name`, and with the line unless `lines` is off.

    is_ours: the text comes with Photosite, so that it can be trusted not to nest without end.
    """
    found = _Reading(name, folder)
    with reading(name, "check it for broken YAML"):
        try:
            node = yaml.compose(text, LibraryLoader if is_ours else PlainLoader)
            data = None if node is None else found.convert(node, ())
        except RecursionError:
            raise PhotositeError("broken YAML: nested too deeply; a shot has at most six levels", file=name) from None
        except yaml.YAMLError as error:
            mark = getattr(error, "problem_mark", None)
            reason = " ".join(str(getattr(error, "problem", None) or error).split())
            line = mark.line + 1 if mark and lines else None
            raise PhotositeError(f"broken YAML: {reason}; check indentation, colons and quotes", file=name, line=line) from None
    found.places[()] = Place(name, folder)
    return Document(data, found.places)


class _Reading:
    """Converts the nodes of PyYAML into plain data and records the place of each key."""

    def __init__(self, name: str, folder: Path):
        self.name, self.folder, self.count = name, folder, 0
        self.places: dict[Keys, Place] = {}
        self.open_nodes: set[int] = set()

    def problem(self, node: yaml.Node, rule: str, key: str | None = None, joint: str = ": ") -> PhotositeError:
        return PhotositeError(rule, file=self.name, line=node.start_mark.line + 1, key=key, joint=joint)

    def convert(self, node: yaml.Node, keys: Keys) -> Any:
        self.count += 1
        if self.count > MAX_NODES or id(node) in self.open_nodes:
            raise self.problem(node, "aliases (`*name`) repeat without end; write the values out")
        if isinstance(node, yaml.ScalarNode):
            return self.convert_scalar(node)
        self.open_nodes.add(id(node))
        value: dict[str | int, Any] | list[Any]
        if isinstance(node, yaml.MappingNode) and node.tag == "tag:yaml.org,2002:map":
            value = self.convert_mapping(node, keys)
        elif isinstance(node, yaml.SequenceNode) and node.tag == "tag:yaml.org,2002:seq":
            value = [self.convert(item, keys + (index,)) for index, item in enumerate(node.value)]
        else:
            raise self.problem(node, f"the tag {node.tag} is not used here; write plain values")
        self.open_nodes.discard(id(node))
        return value

    def convert_scalar(self, node: yaml.ScalarNode) -> None | bool | int | float | str:
        text, tag = node.value, node.tag.rpartition(":")[2]
        if not node.tag.startswith("tag:yaml.org,2002:") or tag not in ("null", "bool", "int", "float", "str"):
            raise self.problem(node, f"the tag {node.tag} is not used here; write a plain value")
        try:
            if tag == "float":
                return float(re.sub(r"\.(?=[inIN])", "", text))
            if tag == "int":
                return int(text)
        except ValueError:
            raise self.problem(node, f"`{text}` is no {tag}") from None
        if tag == "bool":
            return text.lower() == "true"
        return None if tag == "null" else text

    def convert_mapping(self, node: yaml.MappingNode, keys: Keys) -> dict[str | int, Any]:
        result: dict[str | int, Any] = {}
        written: dict[str, str | int] = {}  # 100 and "100" are one key, since JSON knows only text keys
        for key_node, value_node in node.value:
            key = self.convert(key_node, keys)
            if not isinstance(key, (str, int)) or isinstance(key, bool):
                raise self.problem(key_node, f"`{key}` cannot be a key; quote it if it is meant as text")
            if (same := written.setdefault(str(key), key)) in result:
                first = self.places[keys + (same,)].text
                raise self.problem(key_node, f"is written twice (first at {first}); keep one", join_keys((*keys, key)), " ")
            self.places[keys + (key,)] = Place(self.name, self.folder, key_node.start_mark.line + 1)
            result[key] = self.convert(value_node, keys + (key,))
        return result
