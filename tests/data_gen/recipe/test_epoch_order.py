"""An epoch visits every sample once, at random, and the samples of a picture while few others are in use."""

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import stats

from data_gen.recipe.epoch_order import epoch_order
from simulator.config.random_streams import RandomStream


@pytest.mark.parametrize(("first", "count", "crops", "window"), [(0, 64, 8, 4), (30, 61, 8, 3), (5, 7, 16, 1), (0, 40, 1, 5)])
def test_every_sample_comes_once(first, count, crops, window):
    assert sorted(epoch_order(RandomStream(1, 0), first, count, crops, window)) == list(range(count))


@pytest.mark.parametrize("window", [1, 3, 16])
def test_few_pictures_are_in_use_at_a_time(window):
    first, crops = 11, 8  # the first and the last picture have fewer samples here
    order = np.array(epoch_order(RandomStream(2, 5), first, 800, crops, window))
    pictures = (first + order) // crops
    places = {picture: np.flatnonzero(pictures == picture) for picture in set(pictures.tolist())}
    in_use = [sum(where[0] <= place <= where[-1] for where in places.values()) for place in range(len(order))]
    assert max(in_use) <= window + 1
    assert window == 1 or np.mean([len(set(batch)) for batch in pictures[:792].reshape(-1, 8)]) > window / 3


def test_orders_of_epochs_and_seeds_differ_and_are_even():
    orders = np.array([epoch_order(RandomStream(7, epoch), 0, 24, 4, 3) for epoch in range(400)])
    assert len({tuple(order) for order in orders.tolist()}) == 400
    assert epoch_order(RandomStream(8, 0), 0, 24, 4, 3) != orders[0].tolist() == epoch_order(RandomStream(7, 0), 0, 24, 4, 3)
    places = np.argsort(orders, axis=1)  # of each sample
    quarters = np.stack([np.bincount(places[:, sample] // 6, minlength=4) for sample in range(24)])
    accept({f"sample {sample}": stats.chisquare(counts).pvalue for sample, counts in enumerate(quarters)})
