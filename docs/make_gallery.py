"""Draws the gallery: each topic of docs/gallery.md with all points of its sweep, and an index page.

python docs/make_gallery.py [TOPIC ...] [--out gallery] [--no-index]
"""

import argparse
import html
import re
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np

from data_gen.sources.gallery_scenes import TOPICS, write_topic
from simulator import PhotositeError
from simulator.config import load_shot, load_sweep
from simulator.pipeline.simulate import simulate_many
from simulator.raw.development import develop

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

PAGE = Path(__file__).resolve().parent / "gallery.md"
TITLES = {
    "bare_sensor_pinhole_lens": ("bare sensor, 1/60 s", "pinhole of 0.25 mm, 208 s", "lens, f/4, 1/12 s"),
    "dolly_zoom": ("24 mm at 1.54 m", "50 mm at 3.2 m", "135 mm at 8.64 m"),
    "aperture_series": ("f/2", "f/2.8", "f/4", "f/5.6"),
    "shutter_series": ("1/50 s", "1/25 s", "1/13 s", "1/6 s"),
    "iso_series": ("ISO 100, 1/12 s", "ISO 400, 1/50 s", "ISO 1600, 1/200 s", "ISO 6400, 1/800 s"),
    "equal_exposure": ("f/1.4, 1/4000 s", "f/5.6, 1/250 s", "f/16, 1/30 s"),
    "ball": ("1/2000 s, f/2", "1/250 s, f/5.7", "1/30 s, f/15.5"),
    "pattern": ("at rest", "moves by two photosites to the right"),
    "fan": ("all rows at once", "rows read from the top, 62 ms", "columns read from the left, 62 ms"),
    "flash": ("no flash, 2 s", "flash, 1/60 s", "flash, 1 s"),
    "drop": ("flash of 1/30,000 s", "flash of 1/200 s"),
    "bullet": ("spark of 1 us", "flash of 1/30,000 s"),
    "stars": ("40 minutes",),
    "small_sensor": ("36 mm wide, 50 mm f/2.8", "18 mm wide, 25.2 mm f/1.4", "18 mm wide, 25.2 mm f/2.8"),
    "spherical_aberration": ("no error, f/2", "6 um of wavefront, f/2", "the same lens, f/4"),
    "circle_of_confusion": ("f/2", "f/4", "f/8"),
    "depth_of_field": ("focus at 2.2 m", "focus at 2.8 m", "focus at 4.5 m"),
}
# Left, top, width and height of a detail that a second row shows, in pixels of the picture.
DETAILS = {
    "aperture_series": (20, 130, 360, 240),
    "iso_series": (480, 420, 240, 160),
    "small_sensor": (20, 130, 360, 240),
    "spherical_aberration": (290, 20, 240, 160),
    "depth_of_field": (600, 60, 300, 200),
}
BRIGHTER_EV = 1.0  # development: the shots keep a stop of highlights


def pictures(name: str, folder: Path) -> list[np.ndarray]:
    """Return the developed pictures of a topic, one for each point of its sweep, (height, width, 3) uint8."""
    path = write_topic(name, folder)
    sweep = load_sweep(path)
    shots = [load_shot(path)] if sweep is None else [point.shot() for point in sweep]
    return [develop(raw, exposure_ev=BRIGHTER_EV, bits=8) for raw in simulate_many(shots)]


def draw(found: list[np.ndarray], titles: tuple[str, ...], detail: tuple[int, int, int, int] | None, path: Path) -> None:
    """Write the pictures side by side as a JPEG, with a detail of each below it where one is given; strips as rows."""
    height, width = found[0].shape[:2]
    if width > 4 * height:
        _draw_strips(found, titles, path)
        return
    rows = 1 if detail is None else 2
    size = 12.0, rows * 12.0 / len(found) * height / width + 0.3
    figure, axes = plt.subplots(rows, len(found), figsize=size, layout="constrained", dpi=100, squeeze=False)
    for column, (picture, title) in enumerate(zip(found, titles, strict=True)):
        axes[0, column].imshow(picture, interpolation="antialiased")
        axes[0, column].set_title(title, fontsize=10)
        if detail is not None:
            x, y, across, down = detail
            axes[1, column].imshow(picture[y : y + down, x : x + across], interpolation="antialiased")
            axes[0, column].add_patch(plt.Rectangle((x, y), across, down, fill=False, edgecolor="white", linewidth=1.0))
    for axis in axes.flat:
        axis.axis("off")
    figure.savefig(path, pil_kwargs={"quality": 82})
    plt.close(figure)


def _draw_strips(found: list[np.ndarray], titles: tuple[str, ...], path: Path) -> None:
    height, width = found[0].shape[:2]
    size = 12.0, len(found) * (12.0 * height / width + 0.3)
    figure, axes = plt.subplots(len(found), 1, figsize=size, layout="constrained", dpi=100)
    for axis, picture, title in zip(axes, found, titles, strict=True):
        axis.imshow(picture, interpolation="antialiased")
        axis.set_title(title, fontsize=10)
        axis.axis("off")
    figure.savefig(path, pil_kwargs={"quality": 82})
    plt.close(figure)


def sections() -> dict[str, str]:
    """Return the sections of docs/gallery.md by topic: heading, text, command and what to try, as Markdown."""
    found = re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    return {match[1]: section for section in found if (match := re.match(r".*`(\w+)\.yaml`\n", section))}


def index_page(names: list[str]) -> str:
    """Return a page of HTML with a picture, heading and text of each topic, which needs nothing but the pictures beside it."""
    parts = []
    for name in names:
        heading, _, text = sections()[name].replace(f": `{name}.yaml`", "", 1).partition("\n")
        shown = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text).strip()
        parts.append(
            f'<h2 id="{name}">{html.escape(heading)}</h2>\n<img src="{name}.jpg" alt="{html.escape(heading)}">\n'
            + "\n".join(_paragraph(block) for block in re.split(r"\n\s*\n", shown))
        )
    style = (
        "body{font:16px/1.5 sans-serif;max-width:1200px;margin:2em auto;padding:0 1em}img{max-width:100%}pre{background:#eee}"
    )
    head = f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>Photosite: gallery</title><style>{style}</style>\n'
    return head + "<h1>Gallery</h1>\n" + "\n".join(parts) + "\n</html>\n"


def _paragraph(block: str) -> str:
    if block.startswith("```"):
        return f"<pre>{html.escape(block.strip('`').strip())}</pre>"
    code = re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(block, quote=False))
    text = re.sub(r"\[([^]]+)\]\([^)]*\)", r"\1", code)
    return f"<p>{text}</p>"


def main() -> int:
    """Write one picture for each topic; returns the exit status."""
    parser = argparse.ArgumentParser(description="Draw the gallery.")
    parser.add_argument("topics", nargs="*", metavar="TOPIC", help=f"Of {', '.join(TITLES)}; all when left out.")
    parser.add_argument("--out", type=Path, default=Path("gallery"), help="Folder for the pictures and index.html.")
    parser.add_argument("--no-index", action="store_true", help="Write no index.html.")
    options = parser.parse_args()
    names = options.topics or list(TITLES)
    if unknown := [name for name in names if name not in TITLES]:
        parser.error(f"no topic {', '.join(unknown)}; give some of {', '.join(TOPICS)}")
    options.out.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    try:
        with TemporaryDirectory() as folder:
            for number, name in enumerate(names):
                draw(pictures(name, Path(folder)), TITLES[name], DETAILS.get(name), options.out / f"{name}.jpg")
                print(f"{number + 1}/{len(names)} {options.out / name}.jpg, {time.monotonic() - start:.0f} s", flush=True)
    except PhotositeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    if not options.no_index:
        (options.out / "index.html").write_text(index_page(names), encoding="utf-8")
        print(f"look at {options.out / 'index.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
