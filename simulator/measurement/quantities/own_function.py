"""A function of the user's own, by its name."""

import importlib
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from simulator.errors import PhotositeError, require
from simulator.measurement.quantities.measured_frame import MeasuredFrame
from simulator.measurement.quantities.quantity import Curve, Figure, Measured


@dataclass(frozen=True)
class OwnFunction:
    """What a Python function tells of the frame: `function(frame: MeasuredFrame)`.

    It returns a number, which becomes the figure `value` without unit; a Figure; a mapping of name to number, Figure or Curve;
    or a Measured. The module is looked for as Python does, and in the current folder.

    function: module.function, such as my_module.my_function.
    """

    function: str

    def __post_init__(self) -> None:
        module, _, name = self.function.rpartition(".")
        parts = [*module.split("."), name]
        good = all(part.isidentifier() for part in parts)
        require(good, "python", self.function, "give module.function, such as my_module.my_function")

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Call the function. Raises PhotositeError where it is missing, fails, or returns something else."""
        function = self.load()
        try:
            result = function(frame)
        except PhotositeError:
            raise
        except Exception as error:
            told = f"raised {type(error).__name__}: {error}; correct the function"
            raise PhotositeError(told, file=frame.name, key="python", value=self.function) from error
        return self._to_measured(result)

    def load(self) -> Callable[[MeasuredFrame], object]:
        """Import the function. Raises PhotositeError where it cannot be imported."""
        module, _, name = self.function.rpartition(".")
        try:
            with _current_folder_first():
                found = getattr(importlib.import_module(module), name, None)
        except Exception as error:
            told = f"module {module} cannot be imported ({error}); start photosite in its folder, or set PYTHONPATH"
            raise PhotositeError(told, key="python", value=self.function) from error
        if not callable(found):
            raise PhotositeError(f"module {module} has no function {name}; check the name", key="python", value=self.function)
        return found

    def _to_measured(self, result: Any) -> Measured:
        """Convert what the function returned."""
        if isinstance(result, Measured):
            return result
        parts = result if isinstance(result, Mapping) else {"value": result}
        figures, curves = {}, {}
        for name, part in parts.items():
            if isinstance(part, Curve):
                curves[str(name)] = part
            elif isinstance(part, Figure):
                figures[str(name)] = part
            else:
                figures[str(name)] = Figure(self._to_number(name, part), "")
        return Measured(figures, curves)

    def _to_number(self, name: object, value: Any) -> float:
        try:
            return float(value)
        except (TypeError, ValueError) as error:
            told = f"returned {type(value).__name__} as {name}; return a number, Figure, Curve, a mapping of these, or Measured"
            raise PhotositeError(told, key="python", value=self.function) from error


@contextmanager
def _current_folder_first() -> Iterator[None]:
    """Look for modules in the current folder, too, as `python -m` does, while the block runs."""
    folder = os.getcwd()
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        sys.path.remove(folder)
