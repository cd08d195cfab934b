"""The order of an epoch: random, with the samples of one picture near each other."""

import numpy as np

from simulator.config.random_streams import RandomStream


def epoch_order(stream: RandomStream, first: int, count: int, crops_per_picture: int = 1, window: int = 1) -> list[int]:
    """Return the indices 0 to count - 1 of an epoch in random order.

    Pictures come in random order. The samples of a picture lie at even random places between its turn and that of the
    `window`-th picture after it, so no more than `window` + 1 pictures are in use at a time. With one sample for each
    picture every order is as likely.
    first: number of the data set's sample that has index 0; samples n // crops_per_picture share a picture.
    """
    draw = stream.generator("order")
    if crops_per_picture == 1:
        return draw.permutation(count).tolist()
    pictures = (first % crops_per_picture + np.arange(count)) // crops_per_picture
    turns = draw.permutation(int(pictures[-1]) + 1)[pictures]
    return np.argsort(turns + window * draw.random(count), kind="stable").tolist()
