"""YAML with the scalars of the 1.2 core schema, not of YAML 1.1.

`1e3` is a number, and `on`, `no`, `12:30` and `2024-01-01` are text: nothing a photographer writes turns into a boolean,
a sexagesimal or a date.
"""

import re
from typing import Any

import yaml

RESOLVERS = (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?[0-9]+", list("-+0123456789")),
    (
        "float",
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        list("-+0123456789."),
    ),
)


class PlainLoader(yaml.SafeLoader):
    """Loader with the scalars of YAML 1.2."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}


class LibraryLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]  # PyYAML may lack libyaml
    """The same by libyaml, ten times faster, for files that come with Photosite: it crashes where files nest without end."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}


class PlainDumper(yaml.SafeDumper):
    """Dumper that quotes exactly what PlainLoader would not read as text."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}

    def ignore_aliases(self, data: Any) -> bool:
        """Write repeated values out; a reader should not have to follow anchors."""
        return True


for _tag, _pattern, _first in RESOLVERS:
    for _class in (PlainLoader, LibraryLoader, PlainDumper):
        _class.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(rf"^(?:{_pattern})$"), _first)


def _text(dumper: PlainDumper, text: str) -> yaml.ScalarNode:
    # PyYAML writes these line breaks of Unicode plainly and folds them when it reads them back.
    style = '"' if re.search("[\x85\u2028\u2029\ufeff]", text) else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


PlainDumper.add_representer(str, _text)


def dump_yaml(data: dict[str, Any]) -> str:
    """Plain data as YAML text that `read_document` reads back unchanged."""
    return yaml.dump(data, Dumper=PlainDumper, sort_keys=False, allow_unicode=True, width=120)


def dump_flow(value: Any) -> str:
    """Plain data as YAML text of one line that `parse_override` reads back unchanged."""
    text: str = yaml.dump(value, Dumper=PlainDumper, sort_keys=False, allow_unicode=True, width=10**9, default_flow_style=True)
    return text.removesuffix("\n").removesuffix("\n...")
