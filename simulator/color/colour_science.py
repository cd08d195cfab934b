"""colour-science, imported once and late: it takes a second, and it warns when matplotlib is missing, which we do not need."""

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
