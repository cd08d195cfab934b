"""Times of the passes of a shot."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from simulator.device import Device


class Stopwatch:
    """Milliseconds by pass. One that is not running costs nothing; one that is waits for the device after each pass."""

    def __init__(self, running: bool = False) -> None:
        self._running = running
        self.times_ms: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str, device: Device) -> Iterator[None]:
        """Add the time of what is done inside, and of what it enqueues, to a pass."""
        if not self._running:
            yield
            return
        device.finish()
        start = time.perf_counter()
        yield
        device.finish()
        self.times_ms[name] = self.times_ms.get(name, 0.0) + 1e3 * (time.perf_counter() - start)
