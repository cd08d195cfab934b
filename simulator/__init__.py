"""The simulator's modules. The public face is `photosite`, which has all names; the few below are here, too.

    >>> from simulator import develop, load_shot, save, simulate
    >>> raw = simulate(load_shot("color_checker", ["exposure.iso=400"]))

Names are imported when they are first used, so that importing the package costs nothing. `__init__.pyi` is their only list: a
line `from simulator.pipeline.simulate import simulate as simulate` there makes `simulate` a name of the package, for type
checkers, who read nothing else, as for programs (as Scientific Python's SPEC 1 does it).
"""

import importlib
import re
from collections.abc import Callable
from pathlib import Path

__version__ = "0.2.0"

_LINE = re.compile(r"^from (?P<home>[\w.]+) import (?P<name>\w+) as (?P=name)$", re.MULTILINE)


def homes_of(file: str) -> dict[str, str]:
    """Return each name of the stub beside a Python file with the module that it is imported from."""
    text = Path(file).with_suffix(".pyi").read_text(encoding="utf-8")
    return {found["name"]: found["home"] for found in _LINE.finditer(text)}


def lazy_names(package: str, file: str) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of the package or module `package`, whose file is `file`.

    A name whose home is the package itself is a module inside it.
    """
    homes = homes_of(file)

    def get(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home = homes[name]
        value = importlib.import_module(f"{home}.{name}") if home == package else getattr(importlib.import_module(home), name)
        vars(importlib.import_module(package))[name] = value  # the next look-up finds it without this function
        return value

    def names() -> list[str]:
        return sorted({*vars(importlib.import_module(package)), *homes})

    return get, names, list(homes)


__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
