"""Weights of a release that the wheel lacks: fetched once, into the cache folder.

A wheel has the cards of all weights and the tensors of those that a plain ``bench run`` needs.
``weights.sha256`` beside the methods lists the others, as ``sha256sum`` reads and writes it.
"""

from __future__ import annotations

import importlib
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
    if file.exists() or (copy := kept(file)) is None:
        return file
    import pooch

    method, _, name = released(file)
    url = f"{address()}/releases/download/v{__version__}/{method}-{name}"
    pooch.get_logger().setLevel("WARNING")
    try:
        shown = pooch.HTTPDownloader(progressbar=sys.stderr.isatty())
        pooch.retrieve(url, f"sha256:{_digest(file)}", copy.name, copy.parent, downloader=shown)
        if copy.stat().st_mode & 0o777 == 0o600:  # fetched just now, and for whoever shares the folder
            copy.chmod(0o644)
    except (OSError, ValueError) as error:  # no network, no such file, no room, or a file of another hash
        reason = str(error).partition("\n")[0]
        raise FileError(
            file,
            f"is not part of the installed package, and could not be fetched from {url} as {copy} "
            f"({reason}); place it there yourself, or set RETARGET_BENCH_CACHE to a folder that can be "
            f"written, or work in a checkout of {address()}",
        ) from error
    return copy


def kept(file: Path) -> Path | None:
    """Where the copy of a file of tensors is, or will be; None for one that a wheel has, or of others."""
    if not (digest := _digest(file)):
        return None
    method, _, name = released(file)
    return cache_folder() / "weights" / f"{method}-{digest[:8]}-{name}"


def intact(file: Path) -> bool:
    """Whether the copy of a file is what the release has."""
    import pooch

    copy = kept(file)
    return copy is not None and pooch.file_hash(str(copy)) == _digest(file)


def _digest(file: Path) -> str:
    """The SHA-256 of a file of the methods in their list; "" where it is not there."""
    parts = released(file)
    return listed(methods_folder() / LIST).get(parts, "") if parts else ""


def released(file: Path) -> tuple[str, ...]:
    """``(METHOD, "weights", NAME)`` of a file of the methods of this package; () of others."""
    folder = methods_folder()
    return file.absolute().relative_to(folder).parts if file.absolute().is_relative_to(folder) else ()


def methods_folder() -> Path:
    """The folder of the methods of this package."""
    return Path(next(iter(importlib.import_module("retarget_bench.methods").__path__))).absolute()


def listed(path: Path) -> dict[tuple[str, ...], str]:
    """Folders and name of a file -> its SHA-256, of a list; {} where there is no list."""
    if not path.is_file():
        return {}
    rows = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
    return {Path(name).parts: digest for digest, name in rows}


def address() -> str:
    """The address of the repository, from ``[project.urls]``; or how it becomes known, where the package
    is in use uninstalled, or installed as it was before."""
    try:
        urls = metadata.metadata("retarget-bench").get_all("Project-URL", [])
    except metadata.PackageNotFoundError:
        urls = []
    return dict(each.split(", ", 1) for each in urls).get("Repository", "(unknown: install it again)")
