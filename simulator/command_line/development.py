"""`photosite develop`."""

from pathlib import Path

from simulator.development import develop, write_image
from simulator.errors import PhotositeError


def develop_file(raw: Path, out: Path | None, settings: dict[str, object], white_balance: str, bits: int | None) -> Path:
    """Develop `raw` into the picture `out` (default: beside it, as PNG) and return its path.

    settings: other arguments of `simulator.development.develop`. Raises PhotositeError.
    """
    target = out or raw.with_suffix(".png")
    if bits is None:
        bits = 8 if target.suffix.lower() in (".png", ".jpg", ".jpeg") else 16
    write_image(target, develop(raw, white_balance=_white_balance(white_balance), bits=bits, **settings))
    return target


def _white_balance(text: str) -> str | tuple[float, ...]:
    if "," not in text:
        return text
    try:
        factors = tuple(float(part) for part in text.split(","))
    except ValueError:
        factors = ()
    if len(factors) != 3:
        raise PhotositeError(f"--white-balance {text}: give camera, daylight, or three numbers such as 2.1,1,1.6")
    return factors
