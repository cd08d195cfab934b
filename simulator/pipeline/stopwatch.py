"""Measured times of the passes of a shot."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from simulator.device import Device


class Stopwatch:
    """Time of each pass [ms]. A running stopwatch waits for the device before and after each pass; another costs nothing."""

    def __init__(self, running: bool = False) -> None:
        self._running = running
        self.times_ms: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str, device: Device) -> Iterator[None]:
        """Add the time of the block, with the device work that it enqueues, to the pass of this name."""
        if not self._running:
            yield
            return
        device.finish()
        start = time.perf_counter()
        yield
        device.finish()
        self.times_ms[name] = self.times_ms.get(name, 0.0) + 1e3 * (time.perf_counter() - start)
