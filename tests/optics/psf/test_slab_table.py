"""The table of kernels by distance holds every core once for each node, mirrored, of all node rows or of those of a band."""

import numpy as np

from simulator.optics.psf.slab_table import MOST_HELD, SlabKernels, row_taps

RADII_PX = np.array([-1.0, 1.0])


def kernels_of(nodes: tuple[int, int], reaches_px: tuple[int, int]) -> SlabKernels:
    """Cores of 3 channels at the nodes of the first quarter; those of even columns reach a photosite less."""
    rng, cores = np.random.default_rng(1), {}
    some = [[rng.random((1, 3, 2 * reach - 1, 2 * reach - 1), np.float32) for reach in (own, own + 1)] for own in reaches_px]
    for row in range((nodes[0] + 1) // 2):
        for column in range((nodes[1] + 1) // 2):
            for slab in range(2):
                cores[slab, row, column] = some[slab][column % 2] * np.float32(1 + row)
    one = np.ones((1, 1, 3, 1, 1), np.float32)
    return SlabKernels(RADII_PX, np.zeros(2, int), nodes, True, cores, one, 2, np.ones(3), np.zeros((2, *nodes), bool))


def core_at(kernels: SlabKernels, line: np.ndarray, slab: int, column: int) -> np.ndarray:
    """Core (3, taps, taps) of a slab and node column in a line, as a work-item finds it."""
    reach, begin = int(kernels.reach_px[slab, column]), int(kernels.first[slab, column])
    taps, across = 2 * reach + 1, int(row_taps(kernels.reach_px[slab, column]))
    return line[begin : begin + 3 * taps * across].reshape(3, taps, across)[:, :, 1 : 1 + taps]


def check(kernels: SlabKernels, table: np.ndarray, first: int) -> None:
    rows, columns = kernels.nodes
    for down in range(first, first + table.shape[1]):
        for slab, across in ((0, 0), (1, 1), (1, columns - 1), (0, columns - 2)):
            row, column = min(down, rows - 1 - down), min(across, columns - 1 - across)
            core = kernels.cores[slab, row, column][0]
            turned = core[:, :: 1 if down == row else -1, :: 1 if across == column else -1]
            assert np.array_equal(core_at(kernels, table[0, down - first], slab, across), turned)


def test_few_kernels_are_one_table() -> None:
    kernels = kernels_of((5, 7), (2, 4))
    table, first = kernels.lines(slice(1, 3))
    assert first == 0 and table.shape == (1, 5, kernels.elements) and table.nbytes < MOST_HELD
    assert kernels.lines(slice(3, 5))[0] is table  # which the device holds
    check(kernels, table, first)


def test_of_many_kernels_those_of_some_rows_are_laid_out() -> None:
    kernels = kernels_of((51, 61), (29, 31))
    assert 4 * 51 * kernels.elements > MOST_HELD
    for rows in (slice(0, 2), slice(19, 23)):
        table, first = kernels.lines(rows)
        assert first == rows.start and table.shape == (1, rows.stop - rows.start, kernels.elements)
        check(kernels, table, first)
