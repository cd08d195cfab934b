"""Previews of a study's points as data inside the page."""

import base64
from pathlib import Path

from simulator.errors import reading

PNG = b"\x89PNG\r\n\x1a\n"


def preview_data(folder: Path, name: str) -> tuple[str, int, int] | None:
    """Return the preview of a point as a data address, with its width and height [px]; None where there is none.

    Raises PhotositeError for a file that is no PNG.
    """
    path = folder / "points" / f"{name}.png"
    if not path.is_file():
        return None
    with reading(path, "take the point again"):
        data = path.read_bytes()
        if not data.startswith(PNG):
            raise ValueError("no PNG file")
        width, height = (int.from_bytes(data[place : place + 4], "big") for place in (16, 20))
    return f"data:image/png;base64,{base64.b64encode(data).decode('ascii')}", width, height
