"""The demonstration: one real scene, photographed twice, and a contact sheet.

The scene is the Middlebury 2014 "Motorcycle" photograph with measured disparity, which scikit-image ships. It has 741 x 500
pixels, so the sensor is read with 4 x 4 photosites of a colour binned to one: the frame is then no finer than the scene.
Each shot gives a DNG, its truth twin, a JSON with everything resolved, and a developed PNG.

    python examples/demo.py [--out demo]
"""

import argparse
import sys
from functools import partial
from pathlib import Path

import matplotlib
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from data_gen.sources.motorcycle import motorcycle_scene
from simulator import PhotositeError, develop, load_shot, save, simulate
from simulator.raw.development import write_image
from simulator.raw.raw_image import Raw

matplotlib.use("Agg")

SHOTS = Path(__file__).parent.parent / "configs" / "shots"
NAMES = ("motorcycle_wide_open", "motorcycle_stopped_down")
CAMERA = {"base": "sony_a7s2", "binning": {"factor": 4, "mode": "average"}}  # 1060 x 708 pixels
EXPOSURE_EV = 1.2  # both shots keep a stop of highlights; the sheet is printed lighter
BACKGROUND, ENGINE = (540, 30), (470, 350)  # upper left pixels of the details on the sheet
DETAIL_WIDTH, DETAIL_HEIGHT = 210, 158  # the shape of their places on the sheet, where they are shown 2:1


def take_pictures(out: Path) -> list:
    """Scene, two shots, developed pictures: [(raw, uint8 picture), ...]; files go to `out`."""
    out.mkdir(parents=True, exist_ok=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    taken = []
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("scene", total=1.0 + len(NAMES) * 2.0)
        scene = out / "motorcycle.exr"
        motorcycle_scene(scene)
        for index, name in enumerate(NAMES):
            shot = load_shot(SHOTS / f"{name}.yaml", {"scene.image": str(scene.resolve()), "camera": CAMERA})
            start = 1.0 + 2.0 * index
            raw = simulate(shot, progress=partial(_tell, bar, task, name, start))
            files = save(raw, out)
            bar.update(task, completed=start + 1.2, description=f"{name}: develop")
            picture = develop(files.dng, exposure_ev=EXPOSURE_EV, bits=8)
            write_image(out / f"{name}.png", picture)
            taken.append((raw, picture))
        bar.update(task, completed=1.0 + len(NAMES) * 2.0, description="done")
    return taken


def _tell(bar: Progress, task: TaskID, name: str, start: float, stage: str, share: float) -> None:
    bar.update(task, completed=start + share, description=f"{name}: {stage}")


def caption(raw: Raw) -> str:
    """What a photographer writes under a picture."""
    return f"{raw.focal_length_mm:g} mm  f/{raw.f_number:g}  1/{1 / raw.exposure_time_s:.0f} s  ISO {raw.iso}"


def contact_sheet(taken: list, path: Path) -> None:
    """Each shot whole, and two details at 2:1."""
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(13.0, 12.62), dpi=110, facecolor="white")
    rows = figure.add_gridspec(2, 1, hspace=0.06, left=0.012, right=0.988, top=0.975, bottom=0.012)
    for row, (raw, picture) in zip(rows, taken, strict=True):
        cells = row.subgridspec(2, 2, width_ratios=(2.36, 1.0), hspace=0.09, wspace=0.015)
        whole = figure.add_subplot(cells[:, 0])
        whole.imshow(picture, interpolation="lanczos", aspect="auto")
        whole.set_title(f"{raw.make} {raw.model}   {caption(raw)}", fontsize=13, loc="left", pad=5)
        for cell, (x, y), label in ((cells[0, 1], BACKGROUND, "background, 2:1"), (cells[1, 1], ENGINE, "engine, 2:1")):
            detail = figure.add_subplot(cell)
            detail.imshow(picture[y : y + DETAIL_HEIGHT, x : x + DETAIL_WIDTH], interpolation="nearest", aspect="auto")
            detail.set_title(label, fontsize=11, loc="left", pad=4)
            frame = plt.Rectangle((x, y), DETAIL_WIDTH, DETAIL_HEIGHT, fill=False, edgecolor="white", linewidth=1.0)
            whole.add_patch(frame)
    for axes in figure.axes:
        axes.set_axis_off()
    figure.savefig(path)
    plt.close(figure)


def main() -> int:
    """Run the demonstration; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("demo"))
    options = parser.parse_args()
    try:
        taken = take_pictures(options.out)
        contact_sheet(taken, options.out / "contact_sheet.jpg")
    except PhotositeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    device = taken[0][0].resolved["device"]
    print(f"device: {device['name']} [{device['version']}]")
    for raw, _ in taken:
        clipped = float(np.mean(raw.dn >= raw.white_level_dn))
        print(f"{raw.name}: {caption(raw)}, {raw.mean_electrons.mean():.0f} e- on average, {clipped:.2%} clipped")
    print(f"look at {options.out / 'contact_sheet.jpg'}; open {options.out}/*.dng in any raw converter")
    return 0


if __name__ == "__main__":
    sys.exit(main())
