"""Light that is computed once and used by several shots: the keys by which it is recognised, and the memory that holds it.

The light on the sensor (`pipeline.simulate.expose`) is electron radiance, before shutter, aperture and sensor. Shots with equal
keys have the same light, bit for bit, so that a frame does not depend on what was simulated before it.
"""

import os
import uuid
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, is_dataclass
from threading import RLock
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from simulator.device import Buffer
from simulator.errors import PhotositeError, require
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.optics_planning import optics_key
from simulator.pipeline.shot import Shot
from simulator.scene.content_keys import Itself, freeze, is_ours
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.sensor_plan import SensorPlan

if TYPE_CHECKING:
    from simulator.optics.geometry.motion_plan import Timing

LIGHT_BYTES = 2**30  # memory of a cache, unless an argument or the environment says another
LIGHT_MB = "PHOTOSITE_LIGHT_MB"  # name of the environment's variable [2^20 bytes]
T = TypeVar("T")


@dataclass(frozen=True)
class LightKey:
    """All that the light on the sensor depends on.

    scene: its source, or the scene itself. forms_image: whether there is a lens. window: photosites that are read.
    optics: the rest, of `optics_key`. exposed: of `ExposedLight.key`; None: lines collect steady light for the nominal time.
    """

    scene: Hashable
    forms_image: bool
    window: Window
    optics: Hashable
    exposed: Hashable = None

    def of_mosaic(self, optics: OpticsPlan, sensor: SensorPlan) -> Hashable:
        """Return the key of the mosaic that a plan of this light gives.

        Of a sharp picture, electron radiance does not depend on aperture and shutter: the key has what its projection uses.
        Otherwise they decide on the blur, or on the motion, and how exactly it is computed.
        """
        if optics.defocus is not None or optics.psf is not None or optics.motion is not None:
            return self, optics.cfa, optics.window
        glare, readout = optics.veiling_glare, sensor.readout
        scattered = None if glare is None else (freeze(glare), freeze(sensor.irradiance))
        passes = readout.crosstalk.optical_shares, readout.reaches_optical_black and readout.active
        sampling = freeze(optics.weights), freeze(optics.projection), optics.cfa, optics.window
        return self.scene, self.forms_image, sampling, scattered, passes, self.exposed


def light_key(
    shot: Shot, sensor: SensorPlan, scene: Scene, exposed: Hashable = None, timing: "Timing | None" = None
) -> LightKey | None:
    """Return the key of a shot's light; None where nothing tells when it is the same.

    scene: that of the shot. Sources of the simulator's give the same scene while their fields and files are the same; other
    sources are asked each time. exposed: key of its light over time, of `ExposedLight.key`. timing: of what moves.
    """
    optics, source = optics_key(shot.lens, sensor, shot.tolerance, timing), shot.scene
    if optics is None:
        return None
    try:
        own = freeze(source) if is_ours(source) and not isinstance(source, Scene) else Itself(scene)
    except OSError:  # a file has gone meanwhile
        return None
    return LightKey(own, shot.lens.forms_image, shot.camera.frame, optics, exposed)


class LightCache:
    """Plans and light of the last shots, with their scenes, in a stated amount of memory. Several threads may use one.

    A worker process gets a cache of its own, which holds nothing at first and lives as long as the worker.
    The arrays of a `Scene` that was simulated with a cache must not change while it is used.

    memory_bytes: what is held at most. reused: how often something was there already.
    """

    def __init__(self, memory_bytes: int | None = None) -> None:
        """memory_bytes: what is held at most on host and device [byte]; 0: nothing; None: $PHOTOSITE_LIGHT_MB, else 1 GiB.

        Raises PhotositeError for a negative number, and for a variable that is no number.
        """
        self.memory_bytes = _default_bytes() if memory_bytes is None else memory_bytes
        rule = "give 0, which holds nothing, or more"
        require(self.memory_bytes >= 0, "memory_bytes", self.memory_bytes, rule)
        self._held: OrderedDict[Hashable, object] = OrderedDict()
        self._sizes: dict[Hashable, dict[int, int]] = {}  # of the arrays of each entry, by their identity [byte]
        self._lock = RLock()
        self._token = uuid.uuid4().hex
        self.reused = 0

    def __reduce__(self) -> tuple[Callable[[str, int], "LightCache"], tuple[str, int]]:
        return _cache_of_process, (self._token, self.memory_bytes)

    @property
    def held_bytes(self) -> int:
        """Memory of what is held, arrays that several entries share counted once [byte]."""
        with self._lock:
            joined: dict[int, int] = {}
            for sizes in self._sizes.values():
                joined |= sizes
            return sum(joined.values())

    def clear(self) -> None:
        """Let go of all that is held."""
        with self._lock:
            self._held.clear()
            self._sizes.clear()

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what is held under a key; else make it, and hold it where there is room, for which the oldest entries go."""
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
                self.reused += 1
                return cast(T, self._held[key])
        made = make()
        sizes = dict(_find_memory(made))
        if sum(sizes.values()) > self.memory_bytes or self.memory_bytes == 0:
            return made
        with self._lock:
            self._held[key], self._sizes[key] = made, sizes
            self._held.move_to_end(key)
            while self.held_bytes > self.memory_bytes:
                del self._sizes[self._held.popitem(last=False)[0]]
        return made


_of_process: dict[str, LightCache] = {}  # caches that came to this process from another one, by token


def _cache_of_process(token: str, memory_bytes: int) -> LightCache:
    """Return this process's cache of a token."""
    return _of_process.setdefault(token, LightCache(memory_bytes))


def _default_bytes() -> int:
    text = os.environ.get(LIGHT_MB, "")
    if not text:
        return LIGHT_BYTES
    if not text.isdecimal():
        raise PhotositeError(
            f"give a whole number of megabytes (2^20 bytes), such as {LIGHT_BYTES >> 20}", key=LIGHT_MB, value=text
        )
    return int(text) << 20


def _find_memory(value: Any) -> Iterator[tuple[int, int]]:
    """Yield identity and size [byte] of the arrays and device buffers in a value, at any depth."""
    if isinstance(value, np.ndarray):
        whole = value.base if isinstance(value.base, np.ndarray) else value
        yield id(whole), whole.nbytes
    elif isinstance(value, Buffer):
        yield id(value), value.size
    elif isinstance(value, tuple | list):
        for one in value:
            yield from _find_memory(one)
    elif is_dataclass(value) and not isinstance(value, type):
        for one in vars(value).values():
            yield from _find_memory(one)
