"""Late import of colour-science, which takes a second and warns when matplotlib, which is not needed, is missing."""

import warnings
from functools import cache
from types import ModuleType


@cache
def colour_science() -> ModuleType:
    """The package `colour`."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r'(?s).*"Matplotlib" related API features')
        import colour
        import colour.recovery
    return colour
