"""Tables between those that are made, against the same tables, and how many are made."""

import numpy as np

from simulator.optics.psf.node_tables import tables_of

NODES = 21, 31
AXIS = np.arange(-4, 5)


def table(row: int, column: int, bend: float) -> np.ndarray:
    """A spot that moves away from the middle of the field and widens, (1, 9, 9); of mirrored places mirrored."""
    y, x = (row - NODES[0] // 2) / 20.0, (column - NODES[1] // 2) / 20.0
    width = 1.5 + bend * (x * x + y * y)
    spot = np.exp(-(((AXIS[:, None] - bend * y) / width) ** 2) - ((AXIS - bend * x) / width) ** 2)
    return spot[None].astype(np.float32)


def made_by(bend: float, allowed: float, *, mirrors: bool = True) -> tuple[int, float]:
    """How many tables are made, and the largest error of any."""
    asked: list[tuple[int, int]] = []

    def make(row: int, column: int) -> np.ndarray:
        asked.append((row, column))
        return table(row, column, bend)

    found = tables_of(make, NODES, lambda wrong: bool(np.abs(wrong).max() <= allowed), mirrors=mirrors)
    errors = [np.abs(found.at(row, column) - table(row, column, bend)).max() for row in range(21) for column in range(31)]
    assert len(set(asked)) == len(asked)  # none is made again
    return len(asked), float(max(errors))


def test_a_tenth_of_the_tables_are_made_where_they_bend_little() -> None:
    some, error = made_by(0.3, 1e-3)
    assert some <= 5 * 6 + 2 and error < 1e-3


def test_more_are_made_where_they_bend_more() -> None:
    some, error = made_by(2.0, 1e-3)
    assert 6 * 9 < some < 11 * 16 and error < 3e-3


def test_all_are_made_where_nothing_between_them_fits() -> None:
    some, error = made_by(2.0, 0.0)
    assert some == 11 * 16 and error == 0.0


def test_without_mirror_images_all_corners_are_made() -> None:
    some, error = made_by(0.3, 1e-3, mirrors=False)
    assert 9 * 11 <= some <= 9 * 11 + 2 and error < 1e-3


def test_few_nodes_are_all_made() -> None:
    found = tables_of(lambda row, column: np.full((1, 1, 1), float(10 * row + column)), (3, 5), lambda _: True, mirrors=True)
    assert [float(found.at(1, column)[0, 0, 0]) for column in range(5)] == [10.0, 11.0, 12.0, 11.0, 10.0]
