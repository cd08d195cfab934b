"""Settings as JSON text: the same settings give the same text."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from simulator.errors import PhotositeError


def json_text(name: str, settings: object, **style: Any) -> str:
    """Return settings as JSON with sorted keys; `name` is the shot, style goes to json.dumps.

    Raises PhotositeError for values JSON has no form for.
    """
    try:
        plain = _to_plain_data(settings)
    except TypeError as error:
        raise PhotositeError(f"settings cannot be written as JSON: {error}; give plain values", part=name) from error
    return json.dumps(plain, sort_keys=True, allow_nan=False, **style)


def _to_plain_data(value: object) -> object:
    """Turn numpy types into Python's; inf and nan, which JSON lacks, into the words."""
    if isinstance(value, dict):
        return {str(key): _to_plain_data(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _to_plain_data(value.tolist())
    if isinstance(value, list | tuple):
        return [_to_plain_data(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if value is None or isinstance(value, str | int | bool):
        return value
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{value!r} is a {type(value).__name__}")
