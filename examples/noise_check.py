"""Noise of a data set against the published calibration of the Sony A7S II, ISO by ISO, by statistics and by a classifier.

    python examples/noise_check.py [--out build/noise_check]

Writes noise_check.json and noise_check.png; two minutes.
"""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from noise_comparison import classified, findings, gaussian_divergence, smallest_p
from noise_statistics import Finding
from published_noise import SONY_A7S2
from rich.console import Console
from rich.progress import Progress

from simulator.atomic_files import atomic_write
from simulator.device import open_device
from simulator.errors import PhotositeError
from simulator.measurement.report.figures import iso_axis, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIVERGENCES = ("divergence, dark", "divergence, lit")
PANELS = {
    "row power": "power of the rows' means",
    "vertical correlation": "correlation with the photosite below",
    "horizontal correlation": "correlation with the photosite beside",
}


def draw_figure(by_iso: dict[int, dict[str, Finding]], classifier: dict[str, Finding]) -> "Figure":
    """Draw everything over ISO: divergences, and deviations in standard errors."""
    isos = list(by_iso)
    figure, panels = new_figure(2, 2, 11.0, 7.5)
    for name, color in zip(DIVERGENCES, ("#2874a6", "#d35400"), strict=True):
        found = [by_iso[iso][name] for iso in isos]
        panels[0].loglog(isos, [one.value for one in found], ".", color=color, label=name.removeprefix("divergence, "))
        low, high = ([max(one.expected + side * one.error, 1e-7) for one in found] for side in (-2, 2))
        panels[0].fill_between(isos, low, high, color=color, alpha=0.2, linewidth=0)
    panels[0].loglog(isos, [gaussian_divergence(SONY_A7S2[iso]) for iso in isos], color="#888888", label="a Gaussian, dark")
    panels[0].set(title="divergence of the histogram (shaded: by chance alone)", xlabel="ISO", ylabel="nat")
    panels[0].legend(fontsize=8)
    for axes, (name, title) in zip(panels[1:], PANELS.items(), strict=True):
        found = [by_iso[iso][name] for iso in isos]
        axes.semilogx(isos, [(one.value - one.expected) / one.error for one in found], ".", color="#222222")
        axes.axhspan(-2, 2, color="#2874a6", alpha=0.12, linewidth=0)
        axes.set(title=title, xlabel="ISO", ylabel="deviation [standard errors]", ylim=(-4.5, 4.5))
    for axes in panels:
        iso_axis(axes, isos)
    right = ", ".join(f"{name} {100 * one.value:.1f} %" for name, one in classifier.items())
    figure.suptitle(f"Told from the published model by a classifier: {right}")
    return figure


def write(folder: Path, by_iso: dict[int, dict[str, Finding]], classifier: dict[str, Finding]) -> None:
    """Write noise_check.json and noise_check.png into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = {str(iso): {name: asdict(one) for name, one in found.items()} for iso, found in by_iso.items()}
    numbers["classifier"] = {name: asdict(one) for name, one in classifier.items()}
    with atomic_write(folder / "noise_check.json") as beside:
        beside.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    with atomic_write(folder / "noise_check.png") as beside:
        draw_figure(by_iso, classifier).savefig(beside, format="png")


def main() -> int:
    """Measure, print and write; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build/noise_check"), help="folder for the numbers and the figure")
    parser.add_argument("--frames", type=int, default=100, help="of each kind and ISO")
    parser.add_argument("--patches", type=int, default=4000, help="for the classifier, of each noise")
    options = parser.parse_args()
    try:
        device, by_iso = open_device(), {}
        with Progress(console=Console(stderr=True)) as progress:
            for iso in progress.track(SONY_A7S2, description="ISO"):
                by_iso[iso] = findings(iso, device, options.frames)
            classifier = classified(device, options.patches)
        write(options.out, by_iso, classifier)
    except PhotositeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    chance, tests = smallest_p(by_iso)
    print(f"{tests} tests at {len(by_iso)} ISOs: the smallest p-value has a chance of {chance:.2g}")
    for name, finding in classifier.items():
        print(f"{name} told from the NumPy model: {finding.value:.3f}, by chance {finding.expected} +- {finding.error:.3f}")
    print(f"look at {options.out / 'noise_check.png'}")
    return 0 if chance > 1e-3 and classifier["Photosite"].p_value > 1e-3 else 1


if __name__ == "__main__":
    sys.exit(main())
