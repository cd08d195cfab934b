"""DNG tags of black and white level of a raw frame."""

from simulator.errors import PhotositeError, require
from simulator.raw.dng import tiff
from simulator.raw.dng.tags import Tag
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import Cfa


def levels(raw: Raw, bits_per_sample: int) -> dict[Tag, tiff.Field]:
    """Return BlackLevelRepeatDim, BlackLevel and WhiteLevel, and LinearizationTable of a companded frame.

    Levels are those after the table, which has up to 16 bits whatever the codes have. A frame with a 2x2 pattern, or offsets,
    has four black levels, since LibRaw reads a single one of a 2x2 pattern as 0; any other has one.
    Raises PhotositeError for levels that are not 0 <= black < white < 2^bits: Adobe's reader refuses them.
    """
    black_dn = [raw.black_level_dn + offset for offset in raw.black_offsets_dn]
    if len(black_dn) != 4:
        raise PhotositeError(
            "give one for each place of the 2x2 block", part=raw.name, key="black_offsets_dn", value=raw.black_offsets_dn
        )
    if raw.linearization is not None:
        bits_per_sample = 16
    largest = 2**bits_per_sample - 1
    rule = f"lies outside the codes 1 to {largest} of {bits_per_sample} bits"
    require(1 <= raw.white_level_dn <= largest, "white_level", f"{raw.white_level_dn} DN", rule, part=raw.name)
    rule = f"black lies from 0 up to below the white level, {raw.white_level_dn} DN; lower it, or raise white"
    for level_dn in black_dn:
        require(0 <= level_dn < raw.white_level_dn, "black_level", f"{level_dn:g} DN", rule, part=raw.name)
    single = (raw.cfa == "MONO" or not Cfa.named(raw.cfa).is_small) and not any(raw.black_offsets_dn)
    table = {} if raw.linearization is None else {Tag.LINEARIZATION_TABLE: tiff.short(*raw.linearization.tolist())}
    return {
        **table,
        Tag.BLACK_LEVEL_REPEAT_DIM: tiff.short(1, 1) if single else tiff.short(2, 2),
        Tag.BLACK_LEVEL: _black_level(black_dn[:1] if single else black_dn),
        Tag.WHITE_LEVEL: tiff.short(raw.white_level_dn),
    }


def _black_level(levels_dn: list[float]) -> tiff.Field:
    """Encode black levels as SHORT where they are integers, since some readers truncate fractions."""
    whole = all(float(level).is_integer() for level in levels_dn)
    return tiff.short(*map(int, levels_dn)) if whole else tiff.rational(*levels_dn)
