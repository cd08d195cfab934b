"""What was computed from a scene, kept with it."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import TypeVar, cast

KEPT = 8  # results of one scene
T = TypeVar("T")


class Memo:
    """The last KEPT results by key. Copies and other processes begin with none; several threads may use one."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, object] = OrderedDict()
        self._lock = Lock()

    def __reduce__(self) -> tuple[type["Memo"], tuple[()]]:
        return Memo, ()

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return the result of a key; it is made where it is not kept."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return cast(T, self._kept[key])
        made = make()
        with self._lock:
            self._kept[key] = made
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return made
