"""Fixtures: the device under test, and a bench that runs single kernels, headers and stages."""

import gc
from collections.abc import Generator

import pytest
from helpers.kernel_bench import Bench

from simulator.device import open_device


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect tests without looking for rubbish: what is made stays, and a third of the time went to looking at it again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory):
    """Decoded pictures of tests lie in a folder of the tests. Processes that they start keep the modules that they compile."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
        patch.setenv("PHOTOSITE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def device():
    """The device under test: $PHOTOSITE_DEVICE or the default."""
    return open_device()


@pytest.fixture(scope="session")
def bench(device):
    """Runs parts of the chain."""
    return Bench(device)
