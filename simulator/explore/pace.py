"""How coarse a preview is while a control is moved, so that it is there in time."""

import math

COLUMNS_PX = (360, 240, 180, 120)  # of a preview at rest, and of those while a control is moved
MOST_S = 0.06  # for a preview while a control is moved; the way to the page and its painting take more of the 0.15 s


class Pace:
    """The columns that the next preview has, by the time that the last ones took.

    Time grows with the area. A preview that was too slow makes those that follow coarser at once; one at rest, which has all
    columns, brings them back by one step at a time.
    """

    def __init__(self) -> None:
        self._step = 0

    def columns_px(self, is_moving: bool) -> int:
        """Return the columns of a preview, at most; is_moving: whether others are to follow soon."""
        return COLUMNS_PX[self._step if is_moving else 0]

    def note(self, columns_px: int, seconds: float, is_moving: bool) -> None:
        """Take note of the time that a preview of so many columns took."""
        in_time_px = columns_px * math.sqrt(MOST_S / max(seconds, 1e-6))
        fitting = next((step for step, columns in enumerate(COLUMNS_PX) if columns <= in_time_px), len(COLUMNS_PX) - 1)
        if is_moving:
            self._step = max(self._step, fitting)
        else:
            self._step += (fitting > self._step) - (fitting < self._step)
