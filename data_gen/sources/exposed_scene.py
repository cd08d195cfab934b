"""A scene of radiance as the camera sees it without a lens, exposed so that its highlights lie where they are wanted."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from data_gen.sources.camera_view import camera_view
from data_gen.sources.source import CleanImage
from simulator.color.reproducible import ordered_product
from simulator.errors import PhotositeError, require
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera


def expose_scene(scene: Scene, camera: Camera, light: str, percentile: float, signal: float, path: Path) -> CleanImage:
    """Return the clean picture of a scene, pixel by pixel.

    light: name of what the scene's illuminant is. percentile, signal: this percentile, over the pixels, of the brightest
    channel gets this signal, 1 = saturation. path: for messages.
    Raises PhotositeError for a picture that is dark there, or whose contrast single precision cannot hold.
    """
    view = camera_view(camera, light, scene.illuminant, scene.wavelengths_nm)
    weights = electron_radiance_weights(scene, camera.response.wavelengths_nm, camera.response.quantum_efficiency)
    planes = ordered_product(scene.planes, (weights / weights.max()).astype(np.float32))
    level = float(np.percentile(planes.max(axis=2), percentile))
    require(level > 0, "exposed_percentile", percentile, f"{path} is black there; give a higher one, or take the picture out")
    with np.errstate(over="ignore"):
        planes *= np.float32(signal / level)
    rule = f"{path}: its brightest pixel is too bright for that; give a higher percentile"
    require(bool(np.isfinite(planes.max())), "exposed_percentile", percentile, rule)
    return view.picture(planes)


def check_exposure(percentile: float, signal: float) -> None:
    """Raise PhotositeError unless these can be a percentile and a share of saturation."""
    require(0 < percentile <= 100, "exposed_percentile", percentile, "give a percentage above 0 and up to 100, such as 99")
    require(0 < signal < 1e6, "exposed_signal", signal, "give a share of saturation above 0, such as 0.9")


@contextmanager
def renamed_key(key: str, *scene_keys: str) -> Iterator[None]:
    """In errors about a key of the shot file that the block raises, name the key of the data set's file instead.

    key: of the data set's file. scene_keys: of the shot file.
    """
    try:
        yield
    except PhotositeError as error:
        if not (error.names_a_value and error.key in scene_keys):
            raise
        raise error.replace(key=key) from error
