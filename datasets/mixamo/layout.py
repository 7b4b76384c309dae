"""Files of a Mixamo folder: ``Character/clip.bvh``, and ``test_list.txt`` if present."""

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion.bvh.catalogue import bvh_files, contents, existing, some, subfolders

NOT_CHARACTERS = ("std_bvhs", "mean_var")
"""Folders of the archive of SAN's authors that hold rest poses and statistics, not clips."""
EXAMPLE = "DIR holds one folder per character with its clips, as in DIR/BigVegas/Running.bvh"


@dataclass(frozen=True)
class Layout:
    """The files found.

    clips:  character -> clip name (file name without ``.bvh``) -> file; both sorted by name.
    listed: the clip names of ``test_list.txt``, or None where there is no such file.
    """

    root: Path
    clips: dict[str, dict[str, Path]]
    listed: tuple[str, ...] | None

    @property
    def characters(self) -> tuple[str, ...]:
        return tuple(self.clips)

    @property
    def names(self) -> tuple[str, ...]:
        """Every clip that any character performs, sorted."""
        return tuple(sorted({name for clips in self.clips.values() for name in clips}))


def find(root: str) -> Layout:
    """Look at the folder; raises BenchError that says what is there instead and what to give."""
    if not root:
        raise BenchError(
            "mixamo needs a folder of BVH files that you have got from Mixamo (they may not be passed on): "
            f"give --root DIR, or mixamo[root=DIR]. {EXAMPLE}."
        )
    folder = existing(Path(root).expanduser())
    if folder.is_file():
        raise BenchError(f"{folder} is a file: give the folder of all characters. {EXAMPLE}.")
    clips = {each.name: found for each in _folders(folder) if (found := bvh_files(each))}
    names = Counter(name for found in clips.values() for name in found)
    shared = sum(count > 1 for count in names.values())
    if not clips or (shared < 0.5 * len(names) and _deeper(folder)):
        raise BenchError(_no_clips(folder))
    return Layout(folder, clips, _test_list(folder / "test_list.txt"))


def _folders(folder: Path) -> list[Path]:
    return [each for each in subfolders(folder) if each.name not in NOT_CHARACTERS]


def _deeper(folder: Path) -> list[Path]:
    """Folders that hold no BVH files but folders with some: what a parent of the right folder has."""
    below = [each for each in _folders(folder) if not bvh_files(each)]
    return [each for each in below if any(bvh_files(deep) for deep in _folders(each))]


def _test_list(path: Path) -> tuple[str, ...] | None:
    if not path.is_file():
        return None
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(path, f"is not a list of clip names, one per line ({error})") from error
    names = (re.sub(r"(?i)\.bvh$", "", line.strip()) for line in lines if line.strip())
    return tuple(dict.fromkeys(names))


def _no_clips(folder: Path) -> str:
    """The reason why a folder is not a Mixamo root, and which neighbour is."""
    if own := bvh_files(folder):
        hint = f"--root {folder.resolve().parent}"
        return (
            f"{folder} holds {len(own)} BVH files itself, so it looks like the folder of one character: "
            f"give the folder above it, {hint}. {EXAMPLE}."
        )
    if deeper := _deeper(folder):
        return (
            f"{folder} is no folder of characters that perform the same clips, but a folder in it may be: "
            f"give --root {' or --root '.join(str(each) for each in deeper[:5])}. {EXAMPLE}."
        )
    others = sorted({each.suffix.lower() for each in folder.glob("*/*") if each.is_file() and each.suffix})
    seen = f"; its folders hold {some(others)} files, and only BVH is read" if others else ""
    return f"{folder} holds no Character/clip.bvh; it holds {contents(folder)}{seen}. {EXAMPLE}."
