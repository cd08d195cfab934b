"""Files that leave the simulator: the raw frame (DNG), its truth twin (EXR), the settings (JSON)."""

from importlib.metadata import PackageNotFoundError, version

from simulator import __version__

OURS = "Photosite "  # what the Software tag of our files begins with


def software() -> str:
    """Name and version written into every file, for example "Photosite 1.0.0"."""
    try:
        return f"Photosite {version('photosite')}"
    except PackageNotFoundError:  # run from a source tree that was never installed
        return f"Photosite {__version__}"
