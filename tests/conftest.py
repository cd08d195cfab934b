"""Fixtures: the device under test, and a bench that runs single kernels, headers and stages."""

import pytest
from helpers.kernel_bench import Bench

from simulator.device import open_device


@pytest.fixture(scope="session")
def device():
    """The device under test: $PHOTOSITE_DEVICE or the default."""
    return open_device()


@pytest.fixture(scope="session")
def bench(device):
    """Runs parts of the chain."""
    return Bench(device)
