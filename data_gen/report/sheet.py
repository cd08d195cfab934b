"""Pictures of a data card: samples side by side, and histograms of what the data set holds."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from data_gen.samples.camera_color import camera_to_srgb
from data_gen.samples.packing import pack
from data_gen.samples.sample import Sample
from simulator.color.reproducible import ordered_product
from simulator.measurement.report.figures import MEASURED, new_figure
from simulator.raw.development import srgb_encoded

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN_DIFFERENCE = 0.35  # of the range from black to white, for the 99.5th percentile of the difference


def sample_figure(samples: Sequence[Sample]) -> "Figure":
    """Draw the first frame of each sample in a row: noisy and made as bright as clean, clean, difference.

    Developed by the sample's own white balance and colour matrix, without demosaicing: a pixel is a 2x2 block.
    Raises PhotositeError without matplotlib.
    """
    figure, axes = new_figure(len(samples), 3, 8.4, 2.9 * len(samples))
    for row, sample in enumerate(samples):
        noisy, clean = (linear_picture(sample, frame) for frame in (sample.noisy_dn[0], sample.clean_dn[0]))
        noisy = noisy * sample.exposure_ratios[0]
        lighter = 0.9 / max(float(np.percentile(clean, 99.0)), 1e-3)
        difference = noisy - clean
        enlarged = SHOWN_DIFFERENCE / max(float(np.percentile(np.abs(difference), 99.5)), 1e-6)
        panels = {
            f"noisy: {sample.camera}, ISO {sample.iso}, ratio {sample.exposure_ratios[0]:.3g}": _encode_srgb(lighter * noisy),
            f"clean, x {lighter:.3g}: sample {sample.index}": _encode_srgb(lighter * clean),
            f"noisy - clean, x {enlarged:.3g}": np.clip(0.5 + enlarged * difference, 0.0, 1.0),
        }
        for column, (title, picture) in enumerate(panels.items()):
            _draw(axes[3 * row + column], title, picture)
    return figure


def linear_picture(sample: Sample, mosaic_dn: np.ndarray) -> np.ndarray:
    """Linear sRGB (height / 2, width / 2, 3), 1 where green is at white; grey for MONO.

    Balanced colours are clipped where the first of them saturates, so that what is saturated in all is white.
    """
    signal = (mosaic_dn.astype(np.float64) - sample.black_level_dn) / (sample.white_level_dn - sample.black_level_dn)
    height, width = (side // 2 * 2 for side in signal.shape)
    signal = signal[:height, :width]
    if sample.cfa == "MONO":
        grey = signal.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3))
        return np.repeat(grey[..., np.newaxis], 3, axis=2)
    red, green_red, green_blue, blue = pack(signal, sample.cfa, "rggb")
    balance = np.array(sample.white_balance)
    camera = np.minimum(np.stack([red, 0.5 * (green_red + green_blue), blue], axis=-1) * balance, balance.min())
    return ordered_product(camera, camera_to_srgb(sample.color_matrix).T)


def histogram_figure(counts: Mapping[str, Mapping[str, int]]) -> "Figure":
    """Draw the counts of cameras, ISO, exposure ratio and light of `data_gen.storage.summary`.

    Raises PhotositeError without matplotlib.
    """
    figure, axes = new_figure(2, 2, 9.6, 6.4)
    titles = {
        "camera": ("Camera", "samples"),
        "iso": ("ISO", "samples"),
        "ratio_stops": ("Exposure ratio [stops, rounded down]", "frames"),
        "light_stops": ("Mean clean signal [stops, 0 is saturation, rounded down]", "samples"),
    }
    for one, (kind, (title, unit)) in zip(axes, titles.items(), strict=True):
        shown = _fill_gaps(counts[kind]) if kind.endswith("stops") else counts[kind]
        one.bar(range(len(shown)), list(shown.values()), color=MEASURED)
        step = -(-len(shown) // 12)  # a dozen labels fit
        ticks = range(0, len(shown), step)
        labels = [list(shown)[place] for place in ticks]
        rotated: dict[str, Any] = {"rotation": 30, "ha": "right"} if max(map(len, labels)) > 5 else {}
        one.set_xticks(ticks, labels, fontsize=8, **rotated)
        one.set_title(title, fontsize=10)
        one.set_ylabel(unit)
    return figure


def _fill_gaps(counts: Mapping[str, int]) -> dict[str, int]:
    """Add the missing stops between the first and the last, with count 0."""
    stops = [int(value) for value in counts]
    return {str(stop): counts.get(str(stop), 0) for stop in range(min(stops), max(stops) + 1)}


def _encode_srgb(linear: np.ndarray) -> np.ndarray:
    """Clip a linear picture to 0 ... 1 and apply the sRGB curve."""
    return srgb_encoded(np.clip(linear, 0.0, 1.0))


def _draw(axes: "Axes", title: str, picture: np.ndarray) -> None:
    axes.imshow(picture, interpolation="nearest")
    axes.set_title(title, fontsize=7)
    axes.set_axis_off()
