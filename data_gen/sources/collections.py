"""Collections of clean pictures, as the configuration names them: the key of a section says which kind it is."""

from collections.abc import Callable
from dataclasses import fields
from typing import get_args

from data_gen.sources.data_set import DataSetSamples
from data_gen.sources.linear_images import LinearImages
from data_gen.sources.photographs import Photographs
from data_gen.sources.procedural import Procedural
from data_gen.sources.raw_files import RawFiles
from data_gen.sources.shots import Shots
from data_gen.sources.source import Source
from data_gen.sources.spectral_cubes import SpectralCubes
from simulator.config import defer_fields
from simulator.errors import PhotositeError
from simulator.sensor.camera.camera import Camera

Pictures = Procedural | Photographs | LinearImages | SpectralCubes | RawFiles | Shots | DataSetSamples
KINDS = get_args(Pictures)

# A collection is seen by any camera of the data set, so its section leaves the camera open; raw files and shots have their own.
for _kind in KINDS:
    if "camera" in {field.name for field in fields(_kind)}:
        defer_fields(_kind, "camera")


def open_collection(pictures: dict[str, Source | Callable[..., Source]], collection: str, camera: Camera) -> Source:
    """Return a collection as a camera sees it.

    pictures: sections as the configuration builds them, sources or functions of the camera.
    Raises PhotositeError with the key in the configuration.
    """
    try:
        made = pictures[collection]
        return made if hasattr(made, "read") else made(camera=camera)
    except PhotositeError as error:
        section = f"pictures.{collection}"
        raise (error.replace(key=f"{section}.{error.key}") if error.names_a_value else error.inside(section)) from None
