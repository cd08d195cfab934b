"""Which slabs of blur radius gather the light around a part of a tile."""

import numpy as np

from simulator.optics.passes.psf_bands import STEP_PARTS, split_into_bands
from simulator.optics.passes.psf_slab_tiles import BandNodes, Surroundings, make_slab_terms
from simulator.sensor.camera.camera_sections import Window

RADII_PX = np.array([-0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 3.0, 3.25, 3.5, 3.75])  # of two surfaces


def nodes_of(present: np.ndarray, finer: int = 4) -> BandNodes:
    starts = np.where(RADII_PX < 2.0, 0, 6)
    reach_px = np.full((len(RADII_PX), present.shape[-1]), 5)
    first = 1000 * np.arange(reach_px.size).reshape(reach_px.shape)
    return BandNodes(present, reach_px, first, reach_px > 5, RADII_PX, starts, finer)


def counted(nodes: BandNodes, radius_px: np.ndarray) -> np.ndarray:
    """Blur radii at which light is counted: those around each radius, (radii,)."""
    held = np.zeros(len(nodes.counted_px), bool)
    place = np.interp(radius_px, nodes.counted_px, np.arange(len(held)))
    held[np.floor(place).astype(int)] = held[np.ceil(place).astype(int)] = True
    return held


def test_light_goes_to_the_four_slabs_around_its_radius():
    """All slabs whose cubic is not 0, against every radius between them; light on a slab goes to it alone."""
    for finer in (1, 4):
        nodes = nodes_of(np.ones((1, STEP_PARTS, 3), bool), finer)
        for radius_px in np.concatenate([np.random.default_rng(0).uniform(-0.5, 3.5, 64), nodes.counted_px]):
            place = float(np.interp(radius_px, RADII_PX, np.arange(len(RADII_PX))))
            cell = int(place)
            wanted = (
                [cell] if place == cell else [slab for slab in range(cell - 1, cell + 3) if slab < len(RADII_PX) and slab >= 0]
            )
            assert np.flatnonzero(nodes.slabs(counted(nodes, np.array([radius_px])))).tolist() == wanted
    both = nodes.slabs(counted(nodes, np.array([-0.4, 3.3])))
    assert np.flatnonzero(both).tolist() == [0, 1, 2, 3, 6, 7, 8, 9]


def test_slabs_that_share_the_light_of_a_radius_do_not_occlude_each_other():
    """Nor do those that are nearer by less than a photosite of radius; those of another surface do."""
    nodes = nodes_of(np.ones((1, STEP_PARTS, 3), bool))
    assert nodes.occluding.tolist() == [0, 0, 0, 0, 1, 2, 6, 6, 6, 6]
    assert nodes.history == 4


def test_a_part_of_a_tile_has_terms_for_its_own_columns_of_nodes():
    """Two walls: each part has the slabs that its kernels reach, times the columns of nodes beside it."""
    (band,) = split_into_bands(Window(0, 0, 128, 16), 16, 1)
    present = np.zeros((1, STEP_PARTS, 5), bool)
    for part in range(STEP_PARTS):
        present[0, part, part : part + 2] = True
    nodes = nodes_of(present)
    numbers = np.arange(len(nodes.counted_px), dtype=np.uint64)
    near, far = (int((counted(nodes, np.array([one])) << numbers).sum()) for one in (0.1, 3.3))
    bits = np.full((1, band.rows // 4, band.layout.set_columns), near, np.uint64)
    bits[..., band.layout.set_columns // 2 :] = far
    around = Surroundings.around(band, bits, nodes)
    tiles, terms = make_slab_terms(band, around, np.ones((1, STEP_PARTS), bool), nodes)
    assert tiles[:, 3].tolist() == [2 * 4, 2 * 8, 2 * 8, 2 * 4]  # the two in the middle reach both walls
    assert around.is_even(nodes)[0].tolist() == [True, False, False, True]
    for part, (_, _, first, count) in enumerate(tiles):
        assert set(terms["node_column"][first : first + count].tolist()) == {part, part + 1}
