"""`photosite inspect`."""

import json
import math
from dataclasses import asdict
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from simulator.command_line.screen import console
from simulator.measurement.statistics.inspection import Channel, Inspection, inspect_raw

_BARS = " ▁▂▃▄▅▆▇█"


def inspect_file(path: Path, as_json: bool) -> None:
    """Print what a raw file says and holds. Raises PhotositeError."""
    found = inspect_raw(path)
    if as_json:
        print(json.dumps(asdict(found), indent=2))  # ASCII: a path that is no UTF-8 has letters that cannot be printed
        return
    out = console()
    facts = Table(title=escape(found.path), show_header=False)
    for name, value in _list_facts(found):
        facts.add_row(name, escape(value))
    out.print(facts)
    out.print(_make_level_table(found))
    out.print(_make_noise_table(found))
    out.print("Histogram from 0 to white, heights in log counts")
    for channel in found.channels:
        out.print(f"{channel.name:>4} |{sparkline(channel.histogram)}|")


def sparkline(counts: tuple[int, ...]) -> str:
    """One character a bin, its height logarithmic in the count: blank for none, full for the largest."""
    top = math.log1p(max(counts))
    return "".join(_BARS[math.ceil((len(_BARS) - 1) * math.log1p(count) / top) if count else 0] for count in counts)


def _list_facts(found: Inspection) -> list[tuple[str, str]]:
    camera = " ".join(text for text in (found.make, found.model) if text)
    said = [
        ("written by Photosite", "yes" if found.ours else "no"),
        ("settings", "changed after they were written" if found.config_changed else _describe_settings(found)),
        ("software", found.software),
        ("camera", camera),
        ("lens", found.lens),
        ("taken", found.taken),
        ("ISO", found.iso and f"{found.iso:g}"),
        ("exposure time", found.exposure_time_s and _format_time(found.exposure_time_s)),
        ("aperture", found.f_number and f"f/{found.f_number:.3g}"),
        ("focal length", found.focal_length_mm and f"{found.focal_length_mm:g} mm"),
        ("photosites", f"{found.width_px} x {found.height_px}"),
        ("pattern", found.pattern),
        ("white level", f"{found.white_level_dn} DN"),
        ("file", f"{found.size_bytes / 1e6:.2f} MB"),
    ]
    return [(name, value or "not said") for name, value in said]


def _describe_settings(found: Inspection) -> str | None:
    return found.config_sha256 and f"SHA-256 {found.config_sha256}; photosite resimulate takes the shot again"


def _make_level_table(found: Inspection) -> Table:
    table = Table(title="Codes [DN]")
    for column in ("channel", "photosites", "black", "least", "median", "mean", "largest", "at black or below", "at white"):
        table.add_column(column, justify="left" if column == "channel" else "right")
    for one in found.channels:
        numbers = (
            f"{one.black_level_dn:g}",
            str(one.least_dn),
            f"{one.median_dn:g}",
            f"{one.mean_dn:.2f}",
            str(one.largest_dn),
        )
        table.add_row(one.name, str(one.photosites), *numbers, str(one.at_black), str(one.at_white))
    return table


def _make_noise_table(found: Inspection) -> Table:
    table = Table(title="Noise between photosites: sigma [DN] at a level above black [DN]")
    table.add_column("channel")
    for index in range(max((len(one.noise) for one in found.channels), default=0)):
        table.add_column(f"level {index + 1}", justify="right")
    for one in found.channels:
        table.add_row(one.name, *_format_noise(one))
    return table


def _format_noise(channel: Channel) -> list[str]:
    cells = [f"{part.sigma_dn:.2f} at {part.level_dn - channel.black_level_dn:.1f}" for part in channel.noise]
    return cells or ["all cut off at 0 or white"]


def _format_time(seconds: float) -> str:
    return f"1/{1 / seconds:.4g} s" if seconds < 0.3 else f"{seconds:.4g} s"
