"""Say how a motion file is understood, and what to override where that is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from retarget_bench.motion.findings import Findings
from retarget_bench.motion.importer import load

__all__ = ["Findings", "examine"]


def examine(
    path: str | Path,
    *,
    unit: str = "auto",
    up: str = "auto",
    root: str = "auto",
    roles: Mapping[str, str | None] | str | Path | None = None,
) -> Findings:
    """Read a file as ``importer.load`` does, with the same options, and tell what was found and decided.

    ``Findings.text()`` is for the terminal. Raises FileError for files that are no readable BVH.
    """
    return load(path, unit=unit, up=up, root=root, roles=roles).findings
