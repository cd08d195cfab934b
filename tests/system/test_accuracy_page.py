"""docs/accuracy.md shows the numbers that the code has, beside those that others printed."""

import math
import re
from pathlib import Path

import pytest

from simulator.exposure.exposure_value import exposure_value_100, focal_plane_exposure_lx_s, q_factor
from simulator.optics.lens.pinhole import SHARPEST
from simulator.optics.lens.thin_lens import ThinLens

PAGE = (Path(__file__).parents[2] / "docs" / "accuracy.md").read_text(encoding="utf-8")
DIAGONAL_MM = math.hypot(36.0, 24.0)
THIN, APLANATIC = (ThinLens(50.0, 4.0, irradiance=form).irradiance_per_radiance_sr() for form in ("thin_lens", "aplanatic"))
WIDE = [ThinLens(50.0, 1.4, irradiance=form).irradiance_per_radiance_sr() for form in ("thin_lens", "aplanatic")]


def here(what: str) -> str:
    """Return the third column of the row that begins so."""
    (row,) = re.findall(rf"^\| {re.escape(what)}[^|]*\|[^|]*\|([^|]*)\|", PAGE, re.MULTILINE)
    return row.strip()


@pytest.mark.parametrize(
    ("what", "value"),
    [
        ("its magnification", f"{1e3 * ThinLens(3.8628, 4.0, 1.2).magnification:.4f}·10⁻³"),
        ("irradiance per radiance at f/4", f"{THIN:.7f} sr"),
        ("aplanatic irradiance per radiance", f"{APLANATIC:.7f} sr"),
        ("ratio of the two", f"{WIDE[1] / WIDE[0]:.4f}"),
        ("field of view", ", ".join(f"{ThinLens(f, 4.0).field_of_view_deg(DIAGONAL_MM):.2f}°" for f in (17.0, 50.0, 200.0))),
        ("blur disk of a point", f"{2e-3 * ThinLens(50.0, 1.8, 2.0).blur_radius_um(4.0):.5f} mm"),
        ("Airy disk of 550 nm", f"{ThinLens(50.0, 4.0).airy_diameter_um():.2f} µm"),
        ("sharpest pinhole", f"{SHARPEST:.4f}"),
        ("q of the focal plane", f"{q_factor():.7f}"),
        ("exposure at the focal plane", f"{focal_plane_exposure_lx_s(4000, 8, 1 / 250, flare_lx_s=0.0015):.7f} lx s"),
        ("EV at ISO 100", f"{exposure_value_100(8, 1 / 250, 400):.7f}"),
    ],
)
def test_the_page_shows_the_numbers_of_the_code(what, value):
    assert here(what) == value
