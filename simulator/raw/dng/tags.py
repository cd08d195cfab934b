"""Numbers of TIFF, TIFF/EP, Exif and DNG under the names of their specifications.

Sources: TIFF 6.0 (Adobe, 1992), TIFF/EP (ISO 12234-2:2001), XMP Specification Part 3 (tag 700), Exif 2.32
(CIPA DC-008-2019) and DNG 1.4 (Adobe, 2012), whose numbers DNG 1.6 keeps.
"""

from enum import IntEnum


class FieldType(IntEnum):
    """Type of a field's values (TIFF 6.0, section 2; IFD: TIFF Technical Note 1)."""

    BYTE = 1
    ASCII = 2
    SHORT = 3
    LONG = 4
    RATIONAL = 5
    SBYTE = 6
    UNDEFINED = 7
    SSHORT = 8
    SLONG = 9
    SRATIONAL = 10
    FLOAT = 11
    DOUBLE = 12
    IFD = 13


class Tag(IntEnum):
    """Number of a field in a directory."""

    # TIFF 6.0; SubIFDs: TIFF Technical Note 1; XMP: XMP Specification Part 3
    NEW_SUBFILE_TYPE = 254
    IMAGE_WIDTH = 256
    IMAGE_LENGTH = 257
    BITS_PER_SAMPLE = 258
    COMPRESSION = 259
    PHOTOMETRIC_INTERPRETATION = 262
    MAKE = 271
    MODEL = 272
    STRIP_OFFSETS = 273
    ORIENTATION = 274
    SAMPLES_PER_PIXEL = 277
    ROWS_PER_STRIP = 278
    STRIP_BYTE_COUNTS = 279
    PLANAR_CONFIGURATION = 284
    SOFTWARE = 305
    SUB_IFDS = 330
    XMP = 700

    # TIFF/EP
    CFA_REPEAT_PATTERN_DIM = 33421
    CFA_PATTERN = 33422

    # Exif
    EXPOSURE_TIME = 33434
    F_NUMBER = 33437
    EXIF_IFD = 34665
    EXPOSURE_PROGRAM = 34850
    PHOTOGRAPHIC_SENSITIVITY = 34855
    SENSITIVITY_TYPE = 34864
    RECOMMENDED_EXPOSURE_INDEX = 34866
    EXIF_VERSION = 36864
    DATE_TIME_ORIGINAL = 36867
    EXPOSURE_BIAS_VALUE = 37380
    SUBJECT_DISTANCE = 37382
    METERING_MODE = 37383
    FOCAL_LENGTH = 37386
    FOCAL_LENGTH_IN_35MM_FILM = 41989
    LENS_SPECIFICATION = 42034
    LENS_MODEL = 42036

    # DNG
    DNG_VERSION = 50706
    DNG_BACKWARD_VERSION = 50707
    UNIQUE_CAMERA_MODEL = 50708
    CFA_PLANE_COLOR = 50710
    CFA_LAYOUT = 50711
    LINEARIZATION_TABLE = 50712
    BLACK_LEVEL_REPEAT_DIM = 50713
    BLACK_LEVEL = 50714
    WHITE_LEVEL = 50717
    DEFAULT_CROP_ORIGIN = 50719
    DEFAULT_CROP_SIZE = 50720
    COLOR_MATRIX_1 = 50721
    COLOR_MATRIX_2 = 50722
    AS_SHOT_NEUTRAL = 50728
    BASELINE_EXPOSURE = 50730
    CALIBRATION_ILLUMINANT_1 = 50778
    CALIBRATION_ILLUMINANT_2 = 50779
    ACTIVE_AREA = 50829
    MASKED_AREAS = 50830
    FORWARD_MATRIX_1 = 50964
    FORWARD_MATRIX_2 = 50965
    OPCODE_LIST_3 = 51022
    NOISE_PROFILE = 51041


class SubfileType(IntEnum):
    """Value of NewSubfileType (TIFF 6.0)."""

    FULL_RESOLUTION = 0
    REDUCED_RESOLUTION = 1


class Compression(IntEnum):
    """Value of Compression (TIFF 6.0; JPEG: DNG 1.4, lossless for a mosaic)."""

    NONE = 1
    JPEG = 7


class Photometric(IntEnum):
    """Value of PhotometricInterpretation (TIFF 6.0; CFA: TIFF/EP; LinearRaw: DNG 1.4)."""

    RGB = 2
    CFA = 32803
    LINEAR_RAW = 34892


class PlanarConfiguration(IntEnum):
    """Value of PlanarConfiguration (TIFF 6.0)."""

    CHUNKY = 1


class CfaColor(IntEnum):
    """Value in CFAPattern and CFAPlaneColor (TIFF/EP)."""

    RED = 0
    GREEN = 1
    BLUE = 2
    WHITE = 6


class CfaLayout(IntEnum):
    """Value of CFALayout (DNG 1.4)."""

    RECTANGULAR = 1


class LightSource(IntEnum):
    """Value of CalibrationIlluminant1 and 2 (Exif 2.32, LightSource)."""

    STANDARD_LIGHT_A = 17
    D65 = 21


class SensitivityType(IntEnum):
    """Value of SensitivityType (Exif 2.32)."""

    RECOMMENDED_EXPOSURE_INDEX = 2


class Opcode(IntEnum):
    """Number of an operation in an opcode list (DNG 1.4, chapter 7)."""

    WARP_RECTILINEAR = 1


class OpcodeFlag(IntEnum):
    """Flag of an opcode (DNG 1.4, chapter 7)."""

    OPTIONAL = 1  # a reader that does not know the opcode may ignore it
