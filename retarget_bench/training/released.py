"""Weights of a release that the wheel lacks: fetched once, into the cache folder.

A wheel has the cards of all weights and the tensors of those that a plain ``bench run`` needs.
``weights.sha256`` beside the methods lists the others, as ``sha256sum`` reads and writes it.
"""

from __future__ import annotations

import sys
from importlib import metadata
from pathlib import Path

from retarget_bench import __version__
from retarget_bench.errors import FileError
from retarget_bench.files import cache_folder

LIST = "weights.sha256"


def at_hand(file: Path) -> Path:
    """A file of tensors, or where it is absent and the release has it, the copy in the cache folder.

    Raises FileError where it cannot be fetched.
    """
    if file.exists() or not (digest := _digest(file)):
        return file
    import pooch

    copy = _copy(file, digest)
    url = f"{address()}/releases/download/v{__version__}/{file.parts[-3]}-{file.name}"
    pooch.get_logger().setLevel("WARNING")
    try:
        shown = pooch.HTTPDownloader(progressbar=sys.stderr.isatty())
        return Path(pooch.retrieve(url, f"sha256:{digest}", copy.name, copy.parent, downloader=shown))
    except (OSError, ValueError) as error:  # no network, no such file, no room, or a file of another hash
        reason = str(error).partition("\n")[0]
        raise FileError(
            file,
            f"is not part of the installed package, and could not be fetched from {url} ({reason}); "
            f"place it there yourself, or work in a checkout of {address()}",
        ) from error


def to_fetch(file: Path) -> bool:
    """Whether a file is absent and its first use will fetch it."""
    return not file.exists() and bool(digest := _digest(file)) and not _copy(file, digest).exists()


def _digest(file: Path) -> str:
    """The SHA-256 of METHOD/weights/NAME in the list beside the methods; "" where it is not there."""
    return listed(file.parents[2] / LIST).get(file.parts[-3:], "")


def _copy(file: Path, digest: str) -> Path:
    return cache_folder() / "weights" / f"{file.parts[-3]}-{digest[:8]}-{file.name}"


def listed(path: Path) -> dict[tuple[str, ...], str]:
    """Folders and name of a file -> its SHA-256, of a list; {} where there is no list."""
    if not path.is_file():
        return {}
    rows = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
    return {Path(name).parts: digest for digest, name in rows}


def address() -> str:
    """The address of the repository, from ``[project.urls]``; without it where the package is in use
    uninstalled."""
    try:
        urls = metadata.metadata("retarget-bench").get_all("Project-URL", [])
    except metadata.PackageNotFoundError:
        return "(unknown: install retarget-bench by pip)"
    return dict(each.split(", ", 1) for each in urls)["Repository"]
