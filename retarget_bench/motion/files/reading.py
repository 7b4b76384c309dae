"""Options of reading a file, where the file leaves them open: from the user or a TOML file."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from retarget_bench.errors import BenchError, FileError, NotSupported
from retarget_bench.files import read_toml
from retarget_bench.motion.inner_positions import Way
from retarget_bench.motion.roles import is_role, no_role
from retarget_bench.motion.up_axis import UP_AXES
from retarget_bench.options import Option, OptionSet, declared, option

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "dm": 0.1, "inch": 0.0254, "cmu": 0.0254 / 0.45}
"""Metres of one unit. ``cmu``: inches over 0.45, of the CMU motion capture files."""
_FASTEST = 1e5
"""No motion is recorded at more frames per second."""


class Reading(OptionSet):
    """The user's options for a file. They override what is found in it and, where ``reading`` names a TOML
    file, over what that says; a file of ``roles`` is read, too, so that ``reading`` is None afterwards, and
    roles are a table. Raises BenchError for values that are not known, FileError for files that cannot be
    read.
    """

    unit: str | float = option("Unit: m, cm, mm, dm, inch, cmu, or metres per unit.", default="auto")
    up: str = option("Up axis: y, z, x, -y, ...", default="auto")
    take: str | None = option(
        "Which motion of a file with several: name, or number from 1 on.", default=None
    )
    body: str | None = option(
        "Which body of a file with several: name of its root, or number.", default=None
    )
    mirror: bool = option("Mirror the file, which is left-handed: X becomes -X.", default=False)
    rate: float | None = option(
        "Frames per second that the file truly has, over what it says.", default=None
    )
    roles: Mapping[str, str | None] | str | PathLike[str] | None = option(
        'What joints are: a TOML file of lines "joint" = "role", or a table of them.', default=None
    )
    root_place: Literal["auto", "absolute", "relative"] = option(
        "Whether the places of a BVH file's root add to its OFFSET (relative).", default="auto"
    )
    inner_positions: Way = option(
        "Drop, bake (into rotations) or keep (in files of the same body) what joints below the root do "
        "that bones of constant length cannot.",
        default="auto",
        shown="drop, with a warning",
    )
    skeleton: str | PathLike[str] | None = option(
        "ASF file of the bones of an AMC file.", default=None, shown="the one beside it"
    )
    body_model: str | PathLike[str] | None = option(
        "SMPL body model of an AMASS file: a .npz file, or a folder of them.", default=None
    )
    reading: str | PathLike[str] | None = option(
        "A TOML file of all this, as bench doctor --save writes it; what is said beside it wins.",
        default=None,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.roles, str | PathLike):
            table = read_toml(Path(self.roles))
            inner = table.get("roles")
            self._set(roles=_roles(Path(self.roles), inner if isinstance(inner, dict) else table))
        if self.reading is not None:
            explicit = {each.name for each in fields(self) if getattr(self, each.name) != each.default}
            below = vars(_read(Path(self.reading)))
            self._set(**{name: value for name, value in below.items() if name not in explicit})
            self._set(reading=None)
        _ = self.metres  # raises for what is no unit
        if self.up != "auto" and self.up not in UP_AXES:
            raise NotSupported(f"up={self.up!r} is not known; it is auto, {', '.join(UP_AXES)}")
        if self.rate is not None and not (math.isfinite(self.rate) and 0 < self.rate <= _FASTEST):
            raise NotSupported(
                f"rate={self.rate:g} is no frame rate; it is frames per second, such as 30 or 120"
            )

    @staticmethod
    def of(values: Mapping[str, Any]) -> Reading:
        """A reading by names and values as they are written: a number where text is meant is that text.

        Raises BenchError, as for names that are not known."""
        types = declared(Reading)
        for name in values:
            if name not in types:
                near = difflib.get_close_matches(name, types, 1) or types
                raise BenchError(f"{name!r} is nothing that a file is read by; try {', '.join(near)}")
        return Reading(**{name: _fitting(value, types[name]) for name, value in values.items()})

    def __hash__(self) -> int:
        return hash(str(self))

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def overrides(self) -> Mapping[str, str | None]:
        """Joint name -> role or None, of the joints whose role is set."""
        assert self.roles is None or isinstance(self.roles, Mapping)
        return self.roles or {}

    @property
    def metres(self) -> float | None:
        """Metres of one unit; None where that is to be found."""
        if self.unit == "auto" or self.unit in UNITS:
            return UNITS.get(str(self.unit))
        try:
            metres = float(self.unit)
        except ValueError:
            metres = math.nan
        if not (math.isfinite(metres) and metres > 0):
            raise NotSupported(
                f"unit={self.unit!r} is not known; it is auto, {', '.join(UNITS)}, or metres per unit such "
                "as 0.01"
            )
        return metres

    @property
    def files(self) -> dict[str, Path]:
        """The files that are named."""
        options = {"skeleton": self.skeleton, "body_model": self.body_model}
        return {name: Path(path).expanduser() for name, path in options.items() if path is not None}

    @property
    def stated(self) -> dict[str, Any]:
        """The options that are set, by name."""
        return {
            each.name: value for each in fields(self) if (value := vars(self)[each.name]) != each.default
        }


def _fitting(value: Any, field: Option) -> Any:
    written = isinstance(value, int | float) and not (field.is_a(float) or field.is_a(bool))
    return str(value) if written else value


def _read(path: Path) -> Reading:
    """The reading in a TOML file, with a table ``roles``."""
    table = read_toml(path)
    if "reading" in table:
        raise FileError(path, "has a line 'reading', and no reading file may name another: name one file")
    if isinstance(roles := table.get("roles"), dict):
        table["roles"] = _roles(path, roles)
    try:
        return Reading.of(table)
    except FileError:
        raise
    except BenchError as error:
        raise FileError(path, str(error)) from error


def _roles(path: Path, table: Mapping[str, Any]) -> dict[str, str | None]:
    """Joint name -> role, of lines ``"joint name" = "role"``; ``"none"`` or ``""`` takes a role away."""
    roles: dict[str, str | None] = {}
    for name, role in table.items():
        if not isinstance(role, str):
            raise FileError(path, f'{name!r}: expected "joint name" = "role", with both in quotes')
        roles[name] = None if role in ("", "none") else role
        if roles[name] is not None and not is_role(role):
            raise FileError(path, f"{name!r}: {no_role(role)}")
    return roles
