"""Encoding of the mosaic in a DNG: 16 bits per code, packed, or lossless JPEG; always in one strip.

One strip, since LibRaw and dcraw decode only the first of several strips of lossless JPEG, and LibRaw before 0.21 reads
uncompressed tiles wrongly. DNG 1.4 does not allow Deflate and LZW for integers.
"""

from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.raw.disk_arrays import in_blocks
from simulator.raw.dng.tags import Compression
from simulator.raw.dng.tiff import view_bytes
from simulator.raw.raw_image import Raw

_PACKED_BITS = (8, 10, 12, 14, 16)  # depths that every reader unpacks


@dataclass(frozen=True)
class MosaicData:
    """Content of the strip, and the tags that describe it: BitsPerSample and Compression."""

    buffer: bytes | np.ndarray
    bits_per_sample: int
    compression: Compression

    @property
    def size_bytes(self) -> int:
        """Length of the strip."""
        return view_bytes(self.buffer).nbytes


def bits_per_sample(raw: Raw) -> int:
    """Return the bits per code in the frame's storage format.

    Packed rows fill whole bytes, since darktable rejects others; at 16 bits they always do.
    """
    if raw.format.payload == "uncompressed":
        return 16
    step = 8 if raw.format.payload == "packed" else 1
    return next(bits for bits in _PACKED_BITS if bits >= raw.bit_depth and bits * raw.dn.shape[1] % step == 0)


def mosaic_data(raw: Raw) -> MosaicData:
    """Encode the codes of a frame. Raises PhotositeError for a code that does not fit into the bits."""
    bits, dn = bits_per_sample(raw), stored_codes(raw)
    largest = max(int(block.max()) for block in in_blocks(dn)) if bits < 16 else 0
    rule = f"more than {bits} bits hold; take raw.payload: uncompressed"
    require(largest < 2**bits, "code", f"{largest} DN", rule, part=raw.name)
    if raw.format.payload == "lossless_jpeg":
        return MosaicData(_jpeg(dn, bits), bits, Compression.JPEG)
    codes = np.ascontiguousarray(dn, dtype="<u2") if bits == 16 else pack_codes(dn, bits)
    return MosaicData(codes, bits, Compression.NONE)


def stored_codes(raw: Raw) -> np.ndarray:
    """Return the codes that the file stores, (height, width) uint16: those of the frame, companded where it has a table.

    Raises PhotositeError for a code that the table does not hold.
    """
    table = raw.linearization
    if table is None:
        return raw.dn
    code_of = np.zeros(2**16, np.uint16)
    code_of[table] = np.arange(len(table))
    stored = np.empty(raw.dn.shape, np.uint16)
    first = 0
    for block in in_blocks(raw.dn):
        codes = code_of[block]
        wrong = table[codes] != block
        rule = "is none that the linearization table decodes to; take codes of the table"
        require(not wrong.any(), "code", f"{block[wrong][:1]} DN", rule, part=raw.name)
        stored[first : first + len(block)] = codes
        first += len(block)
    return stored


def pack_codes(dn: np.ndarray, bits: int) -> np.ndarray:
    """Pack codes (height, width) without gaps, the most significant bit first, each row of whole bytes (TIFF 6.0).

    bits: 8 to 14, even, and width x bits a multiple of 8. Returns (height, bytes per row) uint8.
    """
    height, width = dn.shape
    packed = np.empty((height, width * bits // 8), np.uint8)
    first = 0
    for block in in_blocks(dn):
        packed[first : first + len(block)] = _pack_rows(block, bits)
        first += len(block)
    return packed


def _pack_rows(dn: np.ndarray, bits: int) -> np.ndarray:
    """Pack a block of rows as `pack_codes` does."""
    height, width = dn.shape
    codes = np.zeros((height, -(-width // 4) * 4), dtype=np.uint64)
    codes[:, :width] = dn
    # Four codes fill whole bytes: they are joined in the upper bits of a 64-bit word, whose first bytes are kept.
    words = codes[:, 0::4] << np.uint64(64 - bits)
    for place in (1, 2, 3):
        words |= codes[:, place::4] << np.uint64(64 - bits * (place + 1))
    octets = words.astype(">u8").view(np.uint8).reshape(height, -1, 8)[..., : bits // 2]
    return octets.reshape(height, -1)[:, : width * bits // 8]


def _jpeg(dn: np.ndarray, bits: int) -> bytes:
    """Encode as lossless JPEG with predictor 1 (the left neighbour), the only one that darktable decodes."""
    from imagecodecs import jpeg_encode

    codes = np.ascontiguousarray(dn, dtype=np.uint8 if bits == 8 else np.uint16)
    return bytes(jpeg_encode(codes, lossless=True, predictor=1, bitspersample=bits))
