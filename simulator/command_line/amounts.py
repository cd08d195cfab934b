"""How the command line writes sizes and times."""


def format_bytes(count: float) -> str:
    """Write a number of bytes with a decimal unit (1 kB = 1000 bytes)."""
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} PB"


def format_duration(seconds: float) -> str:
    """Write a time [s] with the largest unit of which it has at least two."""
    for unit, length in (("days", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.1f} s"


def format_count(count: int, thing: str) -> str:
    """Write a number of things, such as `1 worker` and `2 workers`."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"
