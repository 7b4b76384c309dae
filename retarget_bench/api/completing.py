"""Plug-ins that derive from none of the contracts, completed by what these offer by default."""

from dataclasses import MISSING, fields
from functools import cached_property
from inspect import getattr_static
from typing import Any, TypeVar, cast, get_type_hints

T = TypeVar("T")


def complete(plugin: Any, contract: Any) -> Any:
    """The plug-in itself where it derives from the contract and its card is of the contract's kind; else a
    view of it with the contract's defaults where the plug-in has nothing, which passes for an instance."""
    kind = get_type_hints(contract)["card"]
    as_it_is = isinstance(plugin, contract) and isinstance(plugin.card, kind)
    return plugin if as_it_is else _Completed(plugin, contract, kind)


def original(plugin: Any) -> Any:
    """The object that a plug-in's own code made."""
    return plugin._plugin_ if type(plugin) is _Completed else plugin


class _Completed:
    """What the plug-in has, also by its own ``__getattr__``, comes before what the contract offers."""

    def __init__(self, plugin: Any, contract: type, kind: type) -> None:
        vars(self).update(_plugin_=plugin, _contract_=contract, _kind_=kind)

    @property  # type: ignore[misc]
    def __class__(self) -> type:
        return self._contract_

    @property
    def card(self) -> Any:
        return whole(self._plugin_.card, self._kind_)

    def __reduce__(self) -> tuple[Any, ...]:
        return _Completed, tuple(vars(self).values())

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self._plugin_, name, value)

    def __delattr__(self, name: str) -> None:
        delattr(self._plugin_, name)

    def __getattr__(self, name: str) -> Any:
        default = getattr_static(self._contract_, name, MISSING)
        offered = default is not MISSING and not getattr(default, "__isabstractmethod__", False)
        try:
            own = getattr(self._plugin_, name)
        except AttributeError:
            if not offered:
                raise
            own = None
        if own is not None or not offered:
            return own
        if isinstance(default, cached_property):  # not kept: the plug-in may have its own later
            return default.func(self)
        return default.__get__(self) if hasattr(default, "__get__") else default


# ---------------------------------------------------------------------------------------------- cards
def whole(card: Any, kind: type[T]) -> T:
    """A card with every field: cards of a plug-in's own class may leave fields out."""
    if isinstance(card, kind):
        return card
    known = fields(cast(Any, kind))
    texts = {each.name: "" for each in known if each.default is MISSING and each.default_factory is MISSING}
    stated = {each.name: getattr(card, each.name) for each in known if hasattr(card, each.name)}
    return kind(**{**texts, **stated})


def texts(card: Any, *names: str) -> None:
    """Make texts of fields of a card: a version may be a number, and nothing is an empty text."""
    for name in names:
        if not isinstance(value := getattr(card, name), str):
            object.__setattr__(card, name, "" if value is None else str(value))


def words(card: Any, *names: str) -> None:
    """Make tuples of fields of a card: one word stands for a tuple of one, and nothing for the default."""
    for name in names:
        value = getattr(card, name) or getattr(type(card), name)
        object.__setattr__(card, name, (value,) if isinstance(value, str) else tuple(value))
