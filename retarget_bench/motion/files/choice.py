"""One of several things in a file, chosen by number or name."""

from collections.abc import Sequence
from pathlib import Path

from retarget_bench.errors import NotSupported

_LISTED = 12


def chosen(choice: str, names: Sequence[str], kind: str, path: Path) -> int:
    """The place in ``names`` that a choice names: by its name, or its number from 1 on.

    Raises NotSupported, with what there is, where none fits.
    """
    if choice in names:
        return names.index(choice)
    plain = [name.casefold() for name in names]
    if choice.casefold() in plain:
        return plain.index(choice.casefold())
    if choice.isdecimal() and 0 < int(choice[:9]) <= len(names):
        return int(choice) - 1
    listed = ", ".join(f"{number} {name!r}" for number, name in enumerate(names[:_LISTED], 1))
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    raise NotSupported(f"{path} has no {kind} {choice!r}; it has {listed or 'none'}{more}")
