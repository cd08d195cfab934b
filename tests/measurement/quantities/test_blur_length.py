"""The blur of an edge is found again: of a motion and of a circle, in photosites of all colours and of one."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.randomness import accept
from helpers.scene_builders import distances
from scipy import stats

from simulator.errors import PhotositeError
from simulator.measurement.quantities import BlurLength, MeasuredFrame

FINE = 8  # samples per photosite and axis
HEIGHT, WIDTH = 96, 128


def blurred_share(kind: str, length: float, distance: np.ndarray) -> np.ndarray:
    """Closed form of the share of a step under an even blur of this length, and under a disk of this diameter."""
    t = np.clip(2.0 * distance / length, -1.0, 1.0)
    return 0.5 * (1.0 + t) if kind == "motion" else 0.5 + (t * np.sqrt(1.0 - t**2) + np.arcsin(t)) / math.pi


def frame(kind: str, length: float, angle_deg: float, noise: float = 0.0, cfa: str = "MONO") -> MeasuredFrame:
    """Means over photosites of a blurred edge, 1000 to 21000 DN."""
    distance = distances(FINE * WIDTH, FINE * HEIGHT, angle_deg) / FINE
    share = blurred_share(kind, length, distance).reshape(HEIGHT, FINE, WIDTH, FINE).mean(axis=(1, 3))
    dn = 1000.0 + 20000.0 * share + noise * np.random.default_rng(3).standard_normal(share.shape)
    return MeasuredFrame(np.rint(dn).astype(np.uint16), cfa, np.full((2, 2), 64.0), 65535, name="a.dng")


@pytest.mark.parametrize(("length", "angle_deg"), [(2.0, 5.7), (6.5, 0.0), (24.0, 30.0)])
@pytest.mark.parametrize("kind", ["motion", "circle"])
def test_the_length_is_found_at_any_angle_of_the_edge(kind, length, angle_deg):
    """Photosites are means of 8 x 8 samples: 1/1000 of a photosite."""
    found = BlurLength(kind=kind).measure(frame(kind, length, angle_deg)).figures
    assert found["length_px"].value == pytest.approx(length, abs=0.02 if angle_deg else 0.03)
    assert found["residual"].value < 0.003


def test_the_error_is_that_of_the_noise():
    """z-test with the standard error that is told."""
    found = BlurLength(plane="G").measure(frame("motion", 9.0, 5.7, noise=200.0, cfa="RGGB")).figures["length_px"]
    assert found.sigma is not None and 0.0 < found.sigma < 0.1
    accept({"length": 2 * stats.norm.sf(abs(found.value - 9.0) / found.sigma)})


def test_a_blur_of_another_kind_leaves_a_residual():
    light = frame("circle", 24.0, 5.7)
    residuals = [BlurLength(kind=kind).measure(light).figures["residual"].value for kind in ("circle", "motion")]
    assert residuals[1] > 5.0 * residuals[0]


def test_what_is_no_edge_is_refused():
    flat = MeasuredFrame(np.full((60, 60), 900, np.uint16), "MONO", np.zeros((2, 2)), 4095, name="flat.dng")
    with pytest.raises(PhotositeError, match=r"flat\.dng: no (single )?edge"):
        BlurLength().measure(flat)


@pytest.mark.parametrize("kind", ["motion", "circle"])
def test_an_edge_that_clips_is_refused(kind):
    clipped = dataclasses.replace(frame(kind, 9.0, 5.7), white_level_dn=15000)
    with pytest.raises(PhotositeError, match=r"a\.dng: \d+ at or above the white level of 15000 DN of 12288 photosites"):
        BlurLength(kind=kind).measure(dataclasses.replace(clipped, dn=np.minimum(clipped.dn, 15000)))
