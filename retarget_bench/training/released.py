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
    if file.exists() or not (digest := listed(file.parents[2] / LIST).get(file.parts[-3:])):
        return file
    import pooch

    method, _, name = file.parts[-3:]
    url = f"{address()}/releases/download/v{__version__}/{method}-{name}"
    pooch.get_logger().setLevel("WARNING")
    try:
        return Path(
            pooch.retrieve(
                url,
                f"sha256:{digest}",
                f"{method}-{digest[:8]}-{name}",
                cache_folder() / "weights",
                downloader=pooch.HTTPDownloader(progressbar=sys.stderr.isatty()),
            )
        )
    except (OSError, ValueError) as error:  # no network, no such file, no room, or a file of another hash
        reason = str(error).partition("\n")[0]
        raise FileError(
            file,
            f"is not part of the installed package, and could not be fetched from {url} ({reason}); "
            f"place it there yourself, or work in a checkout of {address()}",
        ) from error


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
