"""Collections of clean pictures, as the configuration names them: the key of a section says which kind it is."""

import re
from collections.abc import Callable
from dataclasses import fields
from typing import get_args

from data_gen.sources import Source
from data_gen.sources.photographs import Photographs
from data_gen.sources.procedural import Procedural
from simulator.config import given_later
from simulator.errors import PhotositeError
from simulator.sensor.camera import Camera

Pictures = Procedural | Photographs
KINDS = get_args(Pictures)

# A collection is seen by any camera of the data set, so its section leaves the camera open.
for _kind in KINDS:
    given_later(_kind, *(field.name for field in fields(_kind) if field.name == "camera"))


def open_collection(pictures: dict[str, Callable[..., Source]], collection: str, camera: Camera) -> Source:
    """Return a collection as a camera sees it.

    pictures: sections as the configuration builds them, each a function of the camera.
    Raises PhotositeError that begins with the key in the configuration.
    """
    try:
        return pictures[collection](camera=camera)
    except PhotositeError as error:
        joint = "." if re.match(r"[\w.]+ = ", str(error)) else ": "
        raise PhotositeError(f"pictures.{collection}{joint}{error}") from None
