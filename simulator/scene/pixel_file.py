"""Pictures as stored: channels by name, read whole or refused with the reason."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simulator.errors import PhotositeError, check_file, file_error, first_line, reading, require
from simulator.progress import counted_as
from simulator.scene.camera_raw import TO_LINEAR_LIGHT, refuse_raw

if TYPE_CHECKING:
    import OpenImageIO as oiio

DAMAGED = "the file is damaged, cut short or no picture: export it again"


@dataclass(frozen=True)
class DataWindow:
    """Where the pixels of an EXR lie in its display window, which is the whole picture.

    x, y: of the first pixel, from the display window's upper left corner [px]. full_width, full_height: of that window [px].
    """

    x: int
    y: int
    full_width: int
    full_height: int

    def __str__(self) -> str:
        return f"x = {self.x}, y = {self.y} of a display window of {self.full_width}x{self.full_height}"


@dataclass(frozen=True)
class PixelFile:
    """One picture file.

    pixels: (height, width, channels) in the stored type; alpha has not been multiplied in.
    channels: their names as the file or OpenImageIO gives them ("R", "G", "B", "A", "Z", "Y", "450nm" ...).
    alpha: index of the alpha channel, or None.
    straight_alpha: the colours are not multiplied by alpha (PNG, and TIFF that says so).
    orientation: how a viewer turns the stored pixels (Exif 2.3, Orientation), 1 to 8; 1 upright.
    color_model: "CMYK", "CIELAB" ... of a file that stores other colours than R, G, B or grey; else "". `check_rgb` tells which
        of them are decoded to R, G, B.
    is_exr: an EXR may carry any number of named channels; other kinds may not.
    chromaticities: red, green, blue and white x, y of an EXR that states them.
    notes: what the reader should know.
    window: where the pixels of an EXR lie; None: of other files, which do not tell.
    bad: indices of the channels that the file marks as bad.
    no_data: what the file writes where it has no data, for messages; such pixels are NaN. "": it states nothing.
    is_unscaled: the numbers are integers in the file, which states no scale for them.
    """

    path: Path
    pixels: np.ndarray
    channels: tuple[str, ...]
    alpha: int | None = None
    is_exr: bool = False
    chromaticities: tuple[float, ...] | None = None
    notes: tuple[str, ...] = ()
    straight_alpha: bool = False
    orientation: int = 1
    color_model: str = ""
    window: DataWindow | None = None
    bad: frozenset[int] = frozenset()
    no_data: str = ""
    is_unscaled: bool = False

    @property
    def size(self) -> tuple[int, int]:
        """(height, width)."""
        return self.pixels.shape[:2]

    def channel(self, name: str, key: str) -> np.ndarray:
        """One channel, (height, width); PhotositeError naming `key` when there is none of that name."""
        require(name in self.channels, key, name, f"no such channel in {self.path}, which has {', '.join(self.channels)}")
        return self.pixels[..., self.channels.index(name)]


@contextmanager
def memory_for(path: str | os.PathLike, key: str) -> Iterator[None]:
    """Turn a MemoryError of the block, which loads `path`, into a PhotositeError that names key and file."""
    try:
        yield
    except MemoryError as error:
        detail = str(error) or "out of memory"
        raise PhotositeError(
            f"does not fit into memory ({detail}); scale it down or end other programs", key=key, value=path
        ) from None


@counted_as("files")
def read_pixels(path: str | os.PathLike, key: str, develop_options: str = TO_LINEAR_LIGHT) -> PixelFile:
    """Read EXR, HDR, TIFF, PNG, JPEG (through OpenImageIO) or a NumPy .npy array (height, width[, channels]).

    key: configuration key for messages. develop_options: that make of a camera's raw file a picture as it is wanted, as
    `refuse_raw` has them.
    Raises PhotositeError for a file that is missing, damaged, cut short, deep, raw, of pixels that are not square, or of an
    unknown kind.
    """
    path = Path(path)
    check_file(path, key)
    refuse_raw(path, key, develop_options)
    return _read_array(path, key) if path.suffix.lower() == ".npy" else _read_picture(path, key)


def load_array(path: Path, key: str) -> np.ndarray:
    """Read a .npy array of numbers; PhotositeError when it is missing or is none."""
    with reading(path, "save one array of numbers with numpy.save", key=key):
        array = np.load(path, allow_pickle=False)
    plain = isinstance(array, np.ndarray) and array.dtype.kind in "fui" and array.size > 0
    require(plain, key, path, "holds no numbers; save one array of floats with numpy.save")
    return array


def _read_array(path: Path, key: str) -> PixelFile:
    array = load_array(path, key)
    require(array.ndim in (2, 3), key, path, f"has shape {array.shape}; give (height, width) or (height, width, channels)")
    array = array.reshape(*array.shape[:2], -1)
    known = {1: ("Y",), 3: ("R", "G", "B")}
    return PixelFile(path, array, known.get(array.shape[2], tuple(f"channel{index}" for index in range(array.shape[2]))))


def _read_picture(path: Path, key: str) -> PixelFile:
    import OpenImageIO as oiio

    wishes = oiio.ImageSpec()
    wishes.attribute("oiio:UnassociatedAlpha", 1)  # else colours of PNG come multiplied by alpha
    with reading(path, DAMAGED, key=key), opened_picture(path, key, wishes) as source:
        spec = source.spec()
        require(not spec.deep, key, path, "is a deep EXR; write deep: instead of image:, or flatten it first")
        is_exr = source.format_name() == "openexr"
        if is_exr:  # the resolution that other kinds of file state is that of a print
            check_square_pixels(spec, key, path)
        pixels, names, unread = _read_parts(source, key, path)
        return PixelFile(
            path,
            pixels,
            names,
            spec.alpha_channel if spec.alpha_channel >= 0 else None,
            is_exr,
            spec.getattribute("chromaticities"),
            _notes(path.name, spec, unread),
            spec.get_int_attribute("oiio:UnassociatedAlpha", 0) == 1,
            spec.get_int_attribute("Orientation", 1),
            spec.get_string_attribute("jpeg:ColorSpace") or spec.get_string_attribute("tiff:ColorSpace"),
            _window(spec) if source.format_name() == "openexr" else None,
        )


def _read_parts(source: "oiio.ImageInput", key: str, path: Path) -> tuple[np.ndarray, tuple[str, ...], int]:
    """Return pixels (height, width, channels), names of the channels, and the number of parts that are left out.

    Parts of an EXR whose size is that of the first are read with it, since renderers give each pass a part; the
    name of a part, such as ViewLayer.Depth, stands before those of its channels unless they begin with it.
    """
    import OpenImageIO as oiio

    first = source.spec()
    count, is_exr = first.get_int_attribute("oiio:subimages", 1), source.format_name() == "openexr"
    planes: list[np.ndarray] = []
    names: list[str] = []
    for part in range(count if is_exr else 1):
        if not source.seek_subimage(part, 0):
            raise unreadable(key, path, source.geterror())
        spec = source.spec()
        own = _channel_names(spec, part)
        same = (spec.x, spec.y, spec.width, spec.height) == (first.x, first.y, first.width, first.height)
        if spec.deep or not same or set(own) & set(names):
            continue
        pixels = _read_channels(source, part, range(spec.nchannels), spec.format, path, key)
        for index, kind in enumerate(spec.channelformats):  # () where all are of one type
            if kind.basetype == oiio.UINT32:  # OpenImageIO divides it by its largest code where others are floats
                pixels[..., index] = _read_channels(source, part, range(index, index + 1), kind, path, key)[..., 0]
        planes.append(pixels)
        names += own
    return (planes[0] if len(planes) == 1 else np.concatenate(planes, axis=2)), tuple(names), count - len(planes)


def _read_channels(
    source: "oiio.ImageInput", part: int, channels: range, kind: "oiio.TypeDesc", path: Path, key: str
) -> np.ndarray:
    """Return neighbouring channels of a part, (height, width, channels), as OpenImageIO converts them to a type."""
    pixels, spec = source.read_image(part, 0, channels.start, channels.stop, kind), source.spec()
    if pixels is None or source.has_error:
        raise unreadable(key, path, source.geterror())
    return np.asarray(pixels).reshape(spec.height, spec.width, len(channels))


def _channel_names(spec: "oiio.ImageSpec", part: int) -> list[str]:
    name = spec.get_string_attribute("oiio:subimagename")
    if part == 0 and "." not in name:  # no pass of a layer: a picture, perhaps with others beside it
        return list(spec.channelnames)
    return [own if not name or own.startswith(f"{name}.") else f"{name}.{own}" for own in spec.channelnames]


def _notes(name: str, spec: "oiio.ImageSpec", unread: int) -> tuple[str, ...]:
    notes = []
    if unread:
        notes.append(f"{name}: {unread} of its parts are left out, whose size or kind is another")
    if (spec.x, spec.y, spec.width, spec.height) != (spec.full_x, spec.full_y, spec.full_width, spec.full_height):
        notes.append(f"{name}: the data window ({spec.width}x{spec.height}) is read, not the display window")
    if spec.get_int_attribute("Orientation", 1) != 1:
        notes.append(f"{name}: is marked as rotated; its pixels are used as they are stored")
    return tuple(notes)


def _window(spec: "oiio.ImageSpec") -> DataWindow:
    return DataWindow(spec.x - spec.full_x, spec.y - spec.full_y, spec.full_width, spec.full_height)


@contextmanager
def opened_picture(path: Path, key: str, wishes: "oiio.ImageSpec | None" = None) -> Iterator["oiio.ImageInput"]:
    """Open a picture with OpenImageIO for the block. wishes: how to read. Raises PhotositeError for a file that is none."""
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path)) if wishes is None else oiio.ImageInput.open(str(path), wishes)
    if source is None:
        raise unreadable(key, path, oiio.geterror())
    try:
        yield source
    finally:
        source.close()


def check_square_pixels(spec: "oiio.ImageSpec", key: str, path: Path) -> None:
    """Raise PhotositeError for an EXR whose pixelAspectRatio is not 1 within a thousandth, such as an anamorphic plate."""
    ratio = spec.get_float_attribute("PixelAspectRatio", 1.0)
    rule = f"its pixels are {ratio:g} times as wide as high (pixelAspectRatio); resample it to square ones"
    require(abs(ratio - 1.0) <= 1e-3, key, path, rule)


def unreadable(key: str, path: Path, reason: str) -> PhotositeError:
    """Error for a file that OpenImageIO cannot read; `reason` is what it said."""
    return file_error(f"cannot be read ({first_line(reason) or 'no reason given'}); {DAMAGED}", path, key)


def check_window(path: Path, key: str, window: DataWindow | None, other: DataWindow | None, whose: str) -> None:
    """Raise PhotositeError, which names key and path, where two pictures of one size are different parts of a picture.

    window, other: of both; None: not known. whose: the other picture, such as "the scene".
    """
    if window is None or other is None or window == other:
        return
    rule = f"its pixels begin at {window}, but those of {whose} at {other}; write both with the display window's size"
    raise PhotositeError(rule, key=key, value=path)


def check_angle(file: PixelFile, field_of_view_deg: float | None) -> None:
    """Raise PhotositeError for an angle [deg] of a picture whose file holds another part of it than its display window.

    Angles count from the picture's middle, and over its width.
    """
    height, width = file.size
    window = file.window
    if field_of_view_deg is None or window is None or window == DataWindow(0, 0, width, height):
        return
    fix = "write it with the display window's size"
    if (2 * window.x + width, 2 * window.y + height) == (window.full_width, window.full_height):
        fix += ", or make the data window its display window (oiiotool --fullpixels) and give the angle of that"
    rule = f"angles count from the middle of a picture, but {file.path} holds {width}x{height} pixels from {window} on; {fix}"
    raise PhotositeError(rule, key="scene.field_of_view", value=f"{field_of_view_deg:g} deg")


def largest_code(stored: np.ndarray, key: str, path: Path) -> int:
    """Return the code that stands for 1: the largest of 8 or 16 bits; 1 of floats.

    Raises PhotositeError that names `key` and the file for other integers, of which nothing tells how many bits are used.
    """
    if stored.dtype.kind == "f":
        return 1
    rule = f"holds {stored.dtype}, of which nothing tells which code is white; give uint8, uint16 or floats"
    require(stored.dtype.kind == "u" and stored.dtype.itemsize <= 2, key, path, rule)  # in either byte order
    return int(np.iinfo(stored.dtype).max)


def check_rgb(file: PixelFile, key: str, fix: str = "convert it to R, G, B") -> None:
    """Raise PhotositeError for colours of a file that do not come as R, G, B or grey, such as CMYK and Lab."""
    rule = f"stores {file.color_model} colours, which are not sRGB; {fix}"
    require(file.color_model in ("", "YCbCr", "palette"), key, file.path, rule)  # these come decoded to R, G, B


def first_fault(fault: np.ndarray) -> str:
    """How many pixels are at fault, and where the first is, of a (height, width[, channels]) bool array."""
    pixels = fault.reshape(*fault.shape[:2], -1).any(axis=2)
    row, column = np.unravel_index(int(pixels.argmax()), pixels.shape)
    return f"{int(pixels.sum())} of {pixels.size} pixels, the first at x = {column}, y = {row} (0, 0 is the upper left corner)"


def check_finite(values: np.ndarray, key: str, path: Path) -> None:
    """Raise PhotositeError that counts NaN and Inf and names the first pixel."""
    if np.isfinite(values.min()) and np.isfinite(values.max()):
        return
    for name, test in (("NaN", np.isnan), ("Inf", np.isinf)):
        fault = test(values)
        if fault.any():
            raise PhotositeError(
                f"{name} in {first_fault(fault)}; render or export it again without {name}", key=key, value=path
            )
