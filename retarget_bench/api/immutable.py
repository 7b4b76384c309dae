"""Read-only values: metrics share their inputs, and none may change those of another."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, is_dataclass
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import Any, Never, TypeVar, cast
from weakref import WeakSet

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh

T = TypeVar("T")
_PLAIN = (str, int, float, bool, type(None))
_CLOSED: WeakSet[Any] = WeakSet()
"""Objects that were made immutable already: all methods are asked the same cases, of few bodies."""


def immutable(value: T) -> T:
    """The value, so that neither it nor anything that is reached through it can be written to.

    Arrays are copied to read-only memory, which NumPy refuses to make writable again; their axes keep their
    order in memory, so that sums over them round alike. Dictionaries and lists are replaced by ones that
    cannot be changed. An object of a dataclass stays the same object, since caches know it by identity: its
    fields are replaced, and its cached properties are computed now.
    """
    return cast(T, _immutable(value))


def _immutable(value: Any) -> Any:
    if type(value) in _PLAIN:
        return value
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, dict | MappingProxyType):
        return value if type(value) is _Dict else _Dict({k: _immutable(each) for k, each in value.items()})
    if isinstance(value, list | tuple):
        return _tuple(value)
    if is_dataclass(value) and not isinstance(value, type):
        _close(value)
    return value


def _array(array: np.ndarray) -> np.ndarray:
    owner: object = array
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, bytes) or array.dtype.hasobject:
        return array
    copy = np.array(array, order="K")
    return np.ndarray(copy.shape, copy.dtype, copy.ravel(order="K").tobytes(), 0, copy.strides)


def _tuple(values: list[Any] | tuple[Any, ...]) -> tuple[Any, ...]:
    closed = tuple(map(_immutable, values))
    unchanged = isinstance(values, tuple) and all(a is b for a, b in zip(closed, values, strict=True))
    return values if unchanged else closed  # type: ignore[return-value]


class _Dict(dict[Any, Any]):
    """A dictionary that refuses changes; copies and pickles of it are usual ones."""

    def _refuse(self, *_: object, **__: object) -> Never:
        raise TypeError("this is shared by all metrics and cannot be changed")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type, tuple[dict[Any, Any]]]:
        return dict, (dict(self),)


# --------------------------------------------------------------------------------------------- objects
@dataclass(frozen=True)
class _ImmutableSkin:
    """Makes a read-only mesh when it is first asked for."""

    skin: Callable[[], Mesh]

    def __call__(self) -> Mesh:
        return immutable(self.skin())


def _close(value: Any) -> None:
    by_identity = type(value).__hash__ is object.__hash__  # type: ignore[comparison-overlap]
    if by_identity and value in _CLOSED:
        return
    held = vars(value)
    if isinstance(value, Character) and not isinstance(value.skin, _ImmutableSkin | None):
        held["skin"] = _ImmutableSkin(value.skin)
    for name in _computed(type(value)):  # type: ignore[arg-type]
        if name not in held:
            with suppress(Exception):  # it is raised again where it is asked for
                getattr(value, name)
    for name, each in held.items():
        if (closed := _immutable(each)) is not each:
            held[name] = closed
    if by_identity:
        _CLOSED.add(value)


@lru_cache(maxsize=256)
def _computed(kind: type) -> tuple[str, ...]:
    """The cached properties of a class, but for meshes: they take long, and skins make immutable ones."""
    attributes = {n: each for base in kind.__mro__ for n, each in vars(base).items()}
    return tuple(n for n, each in attributes.items() if isinstance(each, cached_property) and n != "mesh")
