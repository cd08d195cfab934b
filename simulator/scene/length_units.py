"""Units in which files store lengths."""

from typing import Annotated, Literal

LengthUnit = Annotated[Literal["m", "cm", "mm", "km"], "unit of the stored numbers"]
METRES_PER_UNIT = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3}
