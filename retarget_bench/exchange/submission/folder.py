"""The files of a submission, before any is opened: ordinary ones, inside the folder, none too large."""

import os
from collections.abc import Iterator
from pathlib import Path
from zipfile import BadZipFile, ZipFile

LARGEST = {
    **{".toml": 1_000_000, ".md": 1_000_000, ".json": 50_000_000},
    **{".csv": 500_000_000, ".npz": 1_000_000_000, ".parquet": 1_000_000_000, ".bvh": 500_000_000},
}
"""Suffix -> bytes that a file may have, and bytes of all that an archive unpacks to."""
OTHERS = 10_000_000
MOST_FILES, DEEPEST = 200_000, 6


def faults(folder: Path) -> list[str]:
    """What must not be in a submission. No link is followed, and nothing but archives' lists is read."""
    found: list[str] = []
    for number, entry in enumerate(_entries(folder, 1, found)):
        if number == MOST_FILES:
            return [*found, f"{folder} holds more than {MOST_FILES:,} files"]
        if wrong := _wrong(entry):
            found.append(f"{entry.path} {wrong}")
    return found


def _entries(folder: Path | str, depth: int, found: list[str]) -> Iterator[os.DirEntry[str]]:
    """All but folders, however deep. Folders that cannot be listed are faults."""
    if depth > DEEPEST:
        found.append(f"{folder} lies more than {DEEPEST} folders deep")
        return
    try:
        with os.scandir(folder) as listed:
            entries = sorted(listed, key=lambda entry: entry.name)
    except OSError as error:
        found.append(f"{folder} cannot be listed ({error.strerror})")
        return
    for entry in entries:
        if entry.is_dir(follow_symlinks=False):
            yield from _entries(entry.path, depth + 1, found)
        else:
            yield entry


def _wrong(entry: os.DirEntry[str]) -> str:
    if entry.is_symlink():
        return "is a link; a submission holds its files itself"
    if not entry.is_file(follow_symlinks=False):
        return "is no ordinary file"
    suffix = Path(entry.name).suffix.lower()
    size, most = entry.stat(follow_symlinks=False).st_size, LARGEST.get(suffix, OTHERS)
    if suffix == ".npz" and size <= most:
        try:
            with ZipFile(entry.path) as archive:
                size = max(size, sum(each.file_size for each in archive.infolist()))
        except (OSError, BadZipFile, ValueError, NotImplementedError):
            return ""  # whoever reads it says so
    return f"is of {size:,} bytes, more than the {most:,} that it may have" if size > most else ""
