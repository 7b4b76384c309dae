"""One of several things in a file, chosen by number or name."""

from collections.abc import Sequence
from pathlib import Path

from retarget_bench.errors import NotSupported

_LISTED = 12


def chosen(wanted: str, names: Sequence[str], kind: str, path: Path) -> int:
    """The place in ``names`` of the one that is wanted: by its name, or its number from 1 on.

    Raises NotSupported, with what there is, where none fits.
    """
    if wanted in names:
        return names.index(wanted)
    plain = [name.casefold() for name in names]
    if wanted.casefold() in plain:
        return plain.index(wanted.casefold())
    if wanted.isdecimal() and 0 < int(wanted[:9]) <= len(names):
        return int(wanted) - 1
    listed = ", ".join(f"{number} {name!r}" for number, name in enumerate(names[:_LISTED], 1))
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    raise NotSupported(f"{path} has no {kind} {wanted!r}; it has {listed or 'none'}{more}")
