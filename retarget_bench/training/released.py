"""Weights of a release that the wheel lacks: fetched once, into the cache folder.

A wheel has the cards of all weights and the tensors of those that a plain ``bench run`` needs.
``weights.sha256`` beside the methods lists the others, as ``sha256sum`` reads and writes it.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import NamedTuple

from retarget_bench import __version__, distribution
from retarget_bench.errors import FileError
from retarget_bench.files import cache_folder

LIST = "weights.sha256"


class Released(NamedTuple):
    """A file of tensors of a release. copy: where it is kept, or will be."""

    url: str
    sha256: str
    copy: Path

    def intact(self) -> bool:
        """Whether the copy is what the release has."""
        import pooch

        return bool(pooch.file_hash(str(self.copy)) == self.sha256)


def at_hand(file: Path) -> Path:
    """A file of tensors, or where it is absent and the release has it, the copy in the cache folder.

    Raises FileError where it cannot be fetched.
    """
    if file.exists() or (one := released(file)) is None:
        return file
    import pooch

    pooch.get_logger().setLevel("WARNING")
    try:
        shown = pooch.HTTPDownloader(progressbar=sys.stderr.isatty())
        pooch.retrieve(one.url, f"sha256:{one.sha256}", one.copy.name, one.copy.parent, downloader=shown)
        if one.copy.stat().st_mode & 0o777 == 0o600:  # fetched just now, and for whoever shares the folder
            one.copy.chmod(0o644)
    except (OSError, ValueError) as error:  # no network, no such file, no room, or a file of another hash
        reason = str(error).partition("\n")[0]
        raise FileError(
            file,
            f"is not part of the installed package, and could not be fetched from {one.url} as {one.copy} "
            f"({reason}); place it there yourself, or set RETARGET_BENCH_CACHE to a folder that can be "
            f"written, or work in a checkout of {distribution.address()}",
        ) from error
    return one.copy


def released(file: Path) -> Released | None:
    """What the list of this package's methods has of METHOD/weights/NAME; None for all other files."""
    folder = Path(next(iter(importlib.import_module("retarget_bench.methods").__path__))).absolute()
    if not file.absolute().is_relative_to(folder):
        return None
    parts = file.absolute().relative_to(folder).parts
    if not (sha256 := listed(folder / LIST).get(parts)):
        return None
    asset = f"{parts[0]}-{file.name}"
    return Released(
        f"{distribution.address()}/releases/download/v{__version__}/{asset}",
        sha256,
        cache_folder() / "weights" / f"{sha256[:8]}-{asset}",
    )


def listed(path: Path) -> dict[tuple[str, ...], str]:
    """Folders and name of a file -> its SHA-256, of a list; {} where there is no list."""
    if not path.is_file():
        return {}
    rows = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
    return {Path(name).parts: sha256 for sha256, name in rows}
