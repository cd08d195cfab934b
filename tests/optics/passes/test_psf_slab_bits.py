"""Slabs in which small parts of a band have light: one bit each, against NumPy."""

import numpy as np

from simulator.device import open_device


def test_each_sample_belongs_to_the_slabs_around_its_radius():
    rng, device, rows = np.random.default_rng(0), open_device(), 4
    radii_px = np.array([-1.0, 0.0, 0.5, 2.0], np.float32)
    radius = rng.uniform(-2.0, 3.0, (1, 2, 2 * rows, 6)).astype(np.float32)
    radius[0, 0, 0, 0] = 0.5  # on a slab: it alone
    cover = rng.choice(np.array([0.0, 0.5, 1.0, 1.0], np.float32), (1, 2, 2, 2 * rows, 6))
    found = device.empty((1, 2, 6), np.uint64)
    defines = {"OVER": 1, "CHANNELS": 1, "COVERAGE": 1, "EXTREME_ROWS": rows}
    kernel = device.kernel("psf_slab_bits", defines, file="psf_slab_bits.cl")
    buffers = {"planes": device.upload(cover), "radius": device.upload(radius), "radii_px": device.upload(radii_px)}
    device.run(kernel, (6, 2, 1), None, **buffers, slabs=found, radii=len(radii_px))
    place = np.interp(radius[0], radii_px, np.arange(4.0))
    bits = (1 << np.floor(place).astype(np.uint64)) | (1 << np.ceil(place).astype(np.uint64))
    own = np.where(cover[0, 1] > 0.0, bits, np.uint64(0)) | np.where(cover[0, 1] < 1.0, np.uint64(1 << 63), np.uint64(0))
    expected = np.bitwise_or.reduce(own.reshape(2, 2, rows, 6), axis=(0, 2))
    np.testing.assert_array_equal(device.download(found, (1, 2, 6), np.uint64)[0], expected)


def test_places_between_slabs_are_those_of_a_linear_interpolation():
    device, radii_px = open_device(), np.array([-1.0, 0.0, 0.5, 2.0], np.float32)
    radius = np.concatenate([np.linspace(-3.0, 4.0, 141), radii_px]).astype(np.float32)
    kernel = device.kernel(
        "psf_slab_places", {"OVER": 1, "CHANNELS": 1, "COVERAGE": 1, "EXTREME_ROWS": 4}, file="psf_slab_bits.cl"
    )
    places = device.upload(radius)
    device.run(kernel, (len(radius),), None, radius=places, radii_px=device.upload(radii_px), radii=len(radii_px))
    found = device.download(places, radius.shape, np.float32)
    np.testing.assert_allclose(found, np.interp(radius, radii_px, np.arange(4.0)), atol=1e-6)
    assert found[-4:].tolist() == [0.0, 1.0, 2.0, 3.0]  # exactly: light on a slab goes to it alone
