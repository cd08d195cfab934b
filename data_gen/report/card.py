"""Data card: what a data set is, for people (card.md) and programs (card.json), with a sheet of samples and histograms.

The headings follow what data cards of the Hugging Face hub and "Datasheets for Datasets" (Gebru et al., CACM 2021) ask for:
composition, collection process, uses and licence.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path

from data_gen.report.sheet import histogram_figure, sample_figure
from data_gen.report.snippets import snippet
from data_gen.storage.manifest import read_manifest
from data_gen.storage.reading import SampleFolder
from data_gen.storage.shards import read_summary
from data_gen.storage.summary import merge_counts
from simulator.atomic_files import atomic_write
from simulator.measurement.report.figures import write_figure

CARD_JSON, CARD_TEXT, SAMPLES_PICTURE, HISTOGRAMS_PICTURE = "card.json", "card.md", "card_samples.png", "card_histograms.png"
SHOWN_SAMPLES = 6
_BAR_LETTERS = 30
_TITLES = {
    "camera": "Camera",
    "iso": "ISO",
    "mode": "Mode",
    "cfa": "Colour filter array",
    "shape": "Frames x height x width of the mosaics",
    "ratio_stops": "Exposure ratio, frames, in stops rounded down",
    "light_stops": "Mean of the clean signal in stops, 0 is saturation, rounded down",
}


@dataclass(frozen=True)
class About:
    """What only the author and the configuration know.

    licence: of the data set, such as CC-BY-4.0. sources: a line for each collection used. warnings: what is to be known of the
    numbers of samples.
    """

    name: str
    description: str = ""
    licence: str = "not stated"
    sources: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def write_card(folder: Path, about: About, shown_samples: int = SHOWN_SAMPLES) -> Path:
    """Write card.json, card.md and, where matplotlib is installed, the two pictures, for a data set that has its manifest.

    shown_samples: in the first picture, at least 2.
    Returns the path of card.md. Raises PhotositeError when the data set is not complete.
    """
    manifest = read_manifest(folder)
    counts = merge_counts(read_summary(folder, record) for record in manifest["shards"])
    pictures = find_spec("matplotlib") is not None
    if pictures:
        samples = SampleFolder(folder)
        places = sorted({round(place * (len(samples) - 1) / (shown_samples - 1)) for place in range(shown_samples)})
        write_figure(sample_figure(list(samples.read(places))), folder / SAMPLES_PICTURE)
        write_figure(histogram_figure(counts), folder / HISTOGRAMS_PICTURE)
    pictures_used = len(counts["source"])
    content = asdict(about) | {key: manifest[key] for key in ("software", "dataset", "format", "channels", "samples", "bytes")}
    content |= {"shards": len(manifest["shards"]), "problem_count": manifest["problem_count"], "pictures": pictures_used}
    content |= {kind: counts[kind] for kind in _TITLES}
    with atomic_write(folder / CARD_JSON) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    with atomic_write(folder / CARD_TEXT) as temporary:
        temporary.write_text(_text(content, manifest["shards"][0].name, pictures), encoding="utf-8")
    return folder / CARD_TEXT


def _text(content: Mapping, shard: str, pictures: bool) -> str:
    """Card as Markdown."""
    lossy = {
        "eld": "ELD's layout clips what lies below black and amplifies; use another format to keep the codes.",
        "dng": "Clean codes are rounded to whole numbers.",
    }.get(content["format"], "Noisy codes are uint16 with their pedestal; what lies below black is kept. Nothing is lost.")
    parts = [
        f"# {content['name']}",
        content["description"],
        f"{content['samples']} samples, {content['bytes'] / 1e6:.4g} MB in {content['shards']} shards; format "
        f"{content['format']}, channels {content['channels']}; made by {content['software']}, configuration "
        f"`{content['dataset']}`. Licence: {content['licence']}.",
        f"![Noisy, clean and difference]({SAMPLES_PICTURE})" if pictures else "No pictures: matplotlib was not installed.",
        "## What a sample is",
        "A simulated raw frame (`noisy`, DN), the code that the reference exposure would give without noise (`clean`, DN), "
        "and, if asked for, the variance of each noisy code (`variance`, DN²). The reference exposure has "
        f"`exposure_ratios` times the light of the noisy frame. {lossy} "
        "The facts of a sample name camera, ISO, K (`gain_dn_per_e`, DN/e⁻), read noise, levels, white balance, colour "
        "matrix, seeds, source and crop.",
        "\n".join(f"- {line}." for line in content["warnings"]),
        "## Where it comes from",
        "\n".join(f"- {line}" for line in content["sources"]) or "Not stated.",
        f"{content['pictures']} pictures were used; {content['problem_count']} problems are listed in manifest.json.",
        "## What is in it",
        f"![Histograms]({HISTOGRAMS_PICTURE})" if pictures else "",
        *(_table(title, content[kind]) for kind, title in _TITLES.items()),
        "## How to read it",
        f"In this folder, with Python:\n\n```python\n{snippet(content['format'], shard)}```",
        "`photosite.dataset.read_samples(FOLDER)` gives the samples of any format. "
        "`photosite dataset --verify` compares every "
        "byte with manifest.json.",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _table(title: str, counts: Mapping[str, int]) -> str:
    """Histogram as a table."""
    most = max(counts.values())
    lines = [f"| {value} | {count} | {'█' * round(_BAR_LETTERS * count / most)} |" for value, count in counts.items()]
    return "\n".join([f"| {title} | count | |", "|---|---:|---|", *lines])
