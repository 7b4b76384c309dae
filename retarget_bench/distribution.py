"""What the installed package says of itself: what ``pyproject.toml`` decides and nothing else repeats."""

from importlib import metadata

UNKNOWN = "(unknown: install retarget-bench again)"
"""Where the package is in use uninstalled, or installed as it was before."""


def licence() -> str:
    """The SPDX expression of the code's licence."""
    return (_facts("License-Expression") or [UNKNOWN])[0]


def address() -> str:
    """The address of the repository."""
    return dict(each.split(", ", 1) for each in _facts("Project-URL")).get("Repository", UNKNOWN)


def _facts(name: str) -> list[str]:
    try:
        return metadata.metadata("retarget-bench").get_all(name, [])
    except metadata.PackageNotFoundError:
        return []
