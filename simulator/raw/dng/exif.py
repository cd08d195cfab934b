"""Exif IFD of a raw file: exposure, lens and time (Exif 2.3, CIPA DC-008-2012)."""

from simulator.raw.dng import tiff
from simulator.raw.dng.tags import SensitivityType, Tag
from simulator.raw.raw_image import Raw

_LARGEST_SHORT = 65535
# Values of ExposureProgram and MeteringMode (Exif 2.3, 4.6.5), by the words of a shot file.
_PROGRAMS = {"manual": 1, "programme": 2, "auto": 2, "aperture_priority": 3, "shutter_priority": 4}
_METERING_MODES = {"mean": 1, "centre_weighted": 2, "spot": 3}
_OTHER_METERING = 255


def exif_directory(raw: Raw) -> dict[Tag, tiff.Field]:
    """Return the Exif tags. Values that are unknown, not above 0, or too small or large for the file are left out."""
    tags = {
        Tag.EXIF_VERSION: tiff.undefined(b"0230"),
        Tag.PHOTOGRAPHIC_SENSITIVITY: tiff.short(min(raw.iso, _LARGEST_SHORT)),
    }
    if _LARGEST_SHORT < raw.iso <= tiff.LARGEST_LONG:
        # Exif 2.3, 4.6.5: the 16-bit tag stays at its largest value and a 32-bit one, which SensitivityType names, tells.
        tags[Tag.SENSITIVITY_TYPE] = tiff.short(SensitivityType.RECOMMENDED_EXPOSURE_INDEX)
        tags[Tag.RECOMMENDED_EXPOSURE_INDEX] = tiff.long(raw.iso)
    numbers = {Tag.EXPOSURE_TIME: raw.exposure_time_s, Tag.F_NUMBER: raw.f_number, Tag.FOCAL_LENGTH: raw.focal_length_mm}
    for code, value in numbers.items():
        if tiff.LEAST_RATIONAL <= value < tiff.LARGEST_FILE_BYTES:
            tags[code] = tiff.rational(value)
    if raw.focus_distance_m >= tiff.LEAST_RATIONAL:
        near = raw.focus_distance_m < tiff.LARGEST_FILE_BYTES
        tags[Tag.SUBJECT_DISTANCE] = tiff.rational(raw.focus_distance_m if near else tiff.INFINITE_RATIONAL)
    if tiff.LEAST_RATIONAL <= raw.focal_length_mm < tiff.LARGEST_FILE_BYTES:
        # A lens that does not zoom; its widest aperture is not that of the shot.
        unknown = tiff.UNKNOWN_RATIONAL
        tags[Tag.LENS_SPECIFICATION] = tiff.rational(raw.focal_length_mm, raw.focal_length_mm, unknown, unknown)
    if 0.5 < raw.focal_length_35mm_mm < _LARGEST_SHORT:
        tags[Tag.FOCAL_LENGTH_IN_35MM_FILM] = tiff.short(round(raw.focal_length_35mm_mm))
    if raw.lens_model:
        tags[Tag.LENS_MODEL] = tiff.text(raw.lens_model)
    tags |= _metering_tags(raw)
    if raw.date_time:  # never the clock: one shot gives one file
        tags[Tag.DATE_TIME_ORIGINAL] = tiff.text(raw.date_time.replace("-", ":"))
    return tags


def _metering_tags(raw: Raw) -> dict[Tag, tiff.Field]:
    """Return mode, compensation and metering of a frame whose exposure was metered; none for one set by hand."""
    metered = raw.resolved.get("metered")
    if not isinstance(metered, dict):
        return {}
    return {
        Tag.EXPOSURE_PROGRAM: tiff.short(_PROGRAMS[metered["mode"]]),
        Tag.EXPOSURE_BIAS_VALUE: tiff.signed_rational(metered["compensation"]),
        Tag.METERING_MODE: tiff.short(_METERING_MODES.get(metered["metering"]["pattern"], _OTHER_METERING)),
    }
