"""Collections of clean pictures, as the configuration names them: the key of a section says which kind it is."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Protocol, get_args

from data_gen.sources.data_set import DataSetSamples
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.sources.linear_images import LinearImages
from data_gen.sources.photographs import Photographs
from data_gen.sources.procedural import Procedural
from data_gen.sources.raw_files import RawFiles
from data_gen.sources.shots import Shots
from data_gen.sources.source import PictureSource
from data_gen.sources.spectral_cubes import SpectralCubes
from simulator.config import defer_fields, hide_fields
from simulator.errors import PhotositeError
from simulator.sensor.camera.camera import Camera

Pictures = Procedural | Photographs | LinearImages | SpectralCubes | RawFiles | Shots | DataSetSamples
KINDS = get_args(Pictures)

# A collection is seen by any camera of the data set, so its section leaves the camera open; raw files and shots have their own.
# Where decoded pictures are kept, and what computes shots, is a matter of the machine, not of the data set.
for _kind in KINDS:
    if "camera" in {field.name for field in fields(_kind)}:
        defer_fields(_kind, "camera", "decoded")
hide_fields(Shots, "device")


class UnfinishedPictures(Protocol):
    """A section whose camera is not known yet."""

    def __call__(self, *, camera: Camera) -> PictureSource:
        """Return the collection as this camera sees it."""
        ...


def open_collection(
    pictures: Mapping[str, PictureSource | UnfinishedPictures],
    collection: str,
    camera: Camera,
    decoded: DecodedPictures | None = None,
    device: str | None = None,
) -> PictureSource:
    """Return a collection as a camera sees it.

    pictures: sections as the configuration builds them: sources, or functions that take the camera and return a source.
    decoded: where a collection that decodes pictures keeps them.
    device: part of the label of the OpenCL device on which a collection computes pictures, None for the default.
    Raises PhotositeError with the key in the configuration.
    """
    try:
        made = pictures[collection]
        source = made if isinstance(made, PictureSource) else made(camera=camera)
        if isinstance(source, Photographs):
            return replace(source, decoded=decoded)
        return replace(source, device=device) if isinstance(source, Shots) else source
    except PhotositeError as error:
        section = f"pictures.{collection}"
        raise (error.replace(key=f"{section}.{error.key}") if error.names_a_value else error.inside(section)) from None
