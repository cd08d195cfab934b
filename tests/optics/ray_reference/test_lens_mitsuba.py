"""The reference blur and Mitsuba 3's thin lens see the same surfaces: two programs, one picture."""

import numpy as np
import pytest
from helpers.lens_error import statistics, z_scores
from helpers.mitsuba_lens import PlaneScene
from scipy.ndimage import gaussian_filter

from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.sensor.camera.camera import Window

ROWS, COLUMNS, OVERSAMPLING = 24, 40, 2


def two_planes(radii_px) -> PlaneScene:
    """A near plane whose edges cut through photosites, before a far one; both with texture of all directions."""
    margin = int(np.ceil(np.abs(radii_px).max())) + 2
    shape = ((ROWS + 2 * margin) * OVERSAMPLING, (COLUMNS + 2 * margin) * OVERSAMPLING)
    rng = np.random.default_rng(11)
    colours = []
    for low, high in ((0.1, 0.5), (0.3, 1.2)):
        texture = gaussian_filter(rng.random(shape), 2.0)
        colours.append(low + (high - low) * (texture - texture.min()) / np.ptp(texture))
    middle_row, middle_column = margin * OVERSAMPLING + 11, margin * OVERSAMPLING + 37
    return PlaneScene(colours, (slice(middle_row, None), slice(0, middle_column)), radii_px, margin, OVERSAMPLING)


@pytest.mark.slow
@pytest.mark.parametrize("radii_px", [(-5.0, 6.0), (-11.0, 0.0), (4.0, 9.0)])
def test_planes_out_of_focus_look_the_same(device, radii_px):
    """Below a tenth of the noise of 2000 electrons everywhere, and but for 0.01 sigma no more apart than two renders are."""
    pytest.importorskip("mitsuba")
    scene = two_planes(np.array(radii_px))
    first, second = (scene.render(16384, seed).astype(float) for seed in (1, 2))
    colour, coverage, radius = scene.surfaces()
    surfaces = upload_surfaces(device, colour[:, None], coverage, radius, scene.margin, OVERSAMPLING)
    light = sample_lens(device, surfaces, ray_samples(2**17), Window(0, 0, COLUMNS, ROWS))
    found = statistics(z_scores(device.download(light, (ROWS, COLUMNS), np.float32), 0.5 * (first + second), 2000.0))
    own = statistics(0.5 * z_scores(second, first, 2000.0))
    assert found.p99_9 < 0.1 and abs(found.mean) < 0.01
    assert found.rms**2 < own.rms**2 + 0.01**2  # own: noise of the render's mean
