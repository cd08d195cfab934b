"""Name and version of the software, as written into DNG, EXR and JSON files."""

from functools import cache
from importlib.metadata import PackageNotFoundError, version

from simulator import __version__

OURS = "Photosite "  # what the Software tag of our files begins with


@cache
def software() -> str:
    """Return the name and version written into every file, for example "Photosite 1.0.0"."""
    try:
        return f"Photosite {version('photosite')}"
    except PackageNotFoundError:  # run from a source tree that was never installed
        return f"Photosite {__version__}"
