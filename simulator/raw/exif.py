"""Exif IFD of a raw file: how the picture was taken (Exif 2.3, CIPA DC-008-2012)."""

from simulator.frame import Raw
from simulator.raw import tiff

_LARGEST_SHORT = 65535
_RECOMMENDED_EXPOSURE_INDEX = 2  # SensitivityType


def exif_directory(raw: Raw) -> dict[int, tiff.Field]:
    """Tags by number. What is not known, or no number above 0 that the file can hold, is left out."""
    tags = {36864: tiff.undefined(b"0230"), 34855: tiff.short(min(raw.iso, _LARGEST_SHORT))}
    if raw.iso > _LARGEST_SHORT:  # Exif 2.3, 4.6.5: the 16-bit tag stays at its largest value and a 32-bit one tells
        tags |= {34864: tiff.short(_RECOMMENDED_EXPOSURE_INDEX), 34866: tiff.long(raw.iso)}
    for code, value in ((33434, raw.exposure_time_s), (33437, raw.f_number), (37386, raw.focal_length_mm)):
        if 0 < value < tiff.LARGEST_FILE_BYTES:
            tags[code] = tiff.rational(value)
    if raw.focus_distance_m > 0:
        near = raw.focus_distance_m < tiff.LARGEST_FILE_BYTES
        tags[37382] = tiff.rational(raw.focus_distance_m if near else tiff.INFINITE_RATIONAL)  # SubjectDistance
    if 0 < raw.focal_length_mm < tiff.LARGEST_FILE_BYTES:
        # A lens that does not zoom; its widest aperture is not that of the shot.
        unknown = tiff.UNKNOWN_RATIONAL
        tags[42034] = tiff.rational(raw.focal_length_mm, raw.focal_length_mm, unknown, unknown)  # LensSpecification
    if 0.5 < raw.focal_length_35mm_mm < _LARGEST_SHORT:
        tags[41989] = tiff.short(round(raw.focal_length_35mm_mm))
    if raw.lens_model:
        tags[42036] = tiff.text(raw.lens_model)
    if raw.date_time:  # never the clock: one shot gives one file
        tags[36867] = tiff.text(raw.date_time.replace("-", ":"))  # DateTimeOriginal
    return tags
