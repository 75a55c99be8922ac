"""What planning computes once and keeps: the few last used of each kind, safe between threads, cleared by `forget`."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import RLock
from typing import Generic, TypeVar

Kept = TypeVar("Kept")

_caches: list[Cache] = []


class Cache(Generic[Kept]):
    """A few things by key; the least recently used goes when there are too many."""

    def __init__(self, size: int):
        self._size, self._lock = size, RLock()
        self._things: OrderedDict[Hashable, Kept] = OrderedDict()
        _caches.append(self)

    def get(self, key: Hashable, make: Callable[[], Kept]) -> Kept:
        """What is stored under a key, made if it is not there; another thread that asks for it meanwhile waits."""
        with self._lock:
            if key not in self._things:
                self._things[key] = make()
                if len(self._things) > self._size:
                    self._things.popitem(last=False)
            self._things.move_to_end(key)
            return self._things[key]

    def clear(self) -> None:
        """Drop everything."""
        with self._lock:
            self._things.clear()


def forget() -> None:
    """Drop all tables and programs that planning keeps; a few hundred megabytes at the most."""
    for cache in _caches:
        cache.clear()
