"""Plug-ins that derive from none of the base classes, completed by what these offer by default."""

from dataclasses import MISSING, fields
from functools import cached_property
from inspect import getattr_static
from typing import Any, TypeVar, cast, get_type_hints

T = TypeVar("T")


def complete(plugin: Any, contract: type) -> Any:
    """The plug-in itself where it derives from the contract's base class; else a view of it, which has the
    defaults of that class where the plug-in has nothing, a whole card, and passes for an instance of it."""
    own = plugin.card
    card = whole(own, get_type_hints(contract)["card"])
    if isinstance(plugin, contract) and card is own:
        return plugin
    return _Completed(plugin, contract, card)


def original(plugin: Any) -> Any:
    """The object that a plug-in's own code made."""
    return plugin.completed if type(plugin) is _Completed else plugin


class _Completed:
    """What the plug-in has, also by its own ``__getattr__``, comes before what the contract offers."""

    def __init__(self, plugin: Any, contract: type, card: Any) -> None:
        self.completed, self.contract, self.card = plugin, contract, card

    @property  # type: ignore[misc]
    def __class__(self) -> type:
        return self.contract

    def __reduce__(self) -> tuple[Any, ...]:
        return _Completed, (self.completed, self.contract, self.card)

    def __getattr__(self, name: str) -> Any:
        try:
            return getattr(self.completed, name)
        except AttributeError:
            default = getattr_static(self.contract, name, MISSING)
            if default is MISSING or getattr(default, "__isabstractmethod__", False):
                raise
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


def words(card: Any, *names: str) -> None:
    """Make tuples of fields of a card: one word stands for a tuple of one, and nothing for the default."""
    for name in names:
        value = getattr(card, name) or getattr(type(card), name)
        object.__setattr__(card, name, (value,) if isinstance(value, str) else tuple(value))
