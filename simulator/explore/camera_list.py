"""The cameras that the page offers: that of the opened shot, and those of the library."""

from functools import cache

from simulator.config import load_camera, shipped_names
from simulator.sensor.camera.camera import Camera

OWN = "own"  # the camera of the opened shot
ILLUSTRATIVE = "illustrative"  # folder of the library's sensors that no camera has


def camera_labels(own: Camera) -> dict[str, str]:
    """Return the name of each camera by its value on the page. own: of the opened shot."""
    return {OWN: f"As opened: {describe(own)}"} | {name: describe(library_camera(name)) for name in camera_names()}


@cache
def camera_names() -> tuple[str, ...]:
    """Return the names of the library's cameras, as `camera:` of a shot file takes them."""
    return (*shipped_names("cameras"), *(f"{ILLUSTRATIVE}/{name}" for name in shipped_names(f"cameras/{ILLUSTRATIVE}")))


@cache
def library_camera(name: str) -> Camera:
    """Return a camera of the library. Raises PhotositeError."""
    return load_camera(name)


def describe(camera: Camera) -> str:
    """Return make, model, width of the sensor and megapixels."""
    megapixels = 1e-6 * camera.frame.width * camera.frame.height
    return f"{camera.make} {camera.model}, {camera.sensor_mm[0]:.3g} mm, {megapixels:.3g} Mpx"


def nearest_iso(camera: Camera, iso: int) -> int:
    """Return the ISO of a camera that is nearest to one that it may not have."""
    return min(max(iso, camera.isos[0]), camera.isos[-1])
