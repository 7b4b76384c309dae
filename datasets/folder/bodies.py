"""Bodies and clips found in the user's folders."""

from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from retarget_bench.errors import BenchError, FileError, some
from retarget_bench.files import composed, free_name
from retarget_bench.motion.bvh.document import Hierarchy
from retarget_bench.motion.files import format_of
from retarget_bench.motion.files.catalogue import (
    CatalogueEntry,
    catalogue,
    contents,
    existing,
    hierarchy_of,
    inspect,
    motion_files,
    motions_of,
    subfolders,
)
from retarget_bench.motion.files.formats import AMASS

LAYOUTS = (
    "DIR/clip.bvh, or DIR/Body/clip.bvh with one folder per body; .glb, .gltf, .fbx, .amc (beside its "
    ".asf), .npz (AMASS) and .npy (joint positions) likewise"
)
ROUNDING = 1e-3
"""Share of a body's size within which its files may state its bones."""
Bodies = dict[str, dict[str, Path]]
"""Body name -> clip name -> file."""


@dataclass(frozen=True)
class Files:
    """The bodies and clips found.

    sources: the bodies of ``root``, with the clips that can be read.
    targets: the bodies to retarget to: all of these, or the one that ``target`` names.
    bodies:  the sources, and the target where it lies elsewhere.
    entries: every file looked at.
    joined:  body -> the folders with its clips, of bodies with several.
    """

    sources: Bodies
    targets: tuple[str, ...]
    bodies: Bodies
    entries: Mapping[Path, CatalogueEntry]
    joined: Mapping[str, tuple[str, ...]]


def find(root: str, target: str, rate: float | None = None) -> Files:
    """Look at ``root`` and, where it is not "", at ``target``: files, or folders of files.

    rate: frames per second that all truly have, which some may not state.
    Raises BenchError where there is nothing to work with, saying what is there instead.
    """
    if not root:
        raise BenchError(f"folder needs your files: give --root DIR, or folder[root=DIR]; {LAYOUTS}")
    loose, inside = _sources(existing(Path(root).expanduser()))
    aim = _target(existing(Path(target).expanduser())) if target else {}
    within = [path for clips in inside.values() for path in clips.values()]
    entries = catalogue(Path(root), dict.fromkeys([*loose.values(), *within, *aim.values()]))
    if rate is not None:
        entries = {path: inspect(path, rate) if each.problem else each for path, each in entries.items()}
    folders = {name: _readable(clips, entries) for name, clips in inside.items()}
    sources, joined = _join({name: clips for name, clips in folders.items() if clips}, entries)
    _group(_readable(loose, entries), entries, sources)
    sources = {name: clips for name, clips in sorted(sources.items()) if clips}
    if not sources:
        problems = [f"{path.name} ({entry.problem})" for path, entry in entries.items()]
        raise BenchError(f"none of the files of {root} can be read: {some(problems, 5)}")
    if not target:
        return Files(sources, tuple(sources), sources, entries, joined)
    clips = _readable(aim, entries)
    if not clips:
        raise FileError(target, "; ".join(entries[path].problem for path in aim.values()))
    files = {path.resolve() for path in clips.values()}
    for name, own in sources.items():
        if files <= {path.resolve() for path in own.values()}:
            return Files(sources, (name,), sources, entries, joined)
    name = free_name(Path(target).stem, sources)
    return Files(sources, (name,), {**sources, name: clips}, entries, joined)


def _sources(root: Path) -> tuple[dict[str, Path], Bodies]:
    """Loose files, and files by folder."""
    if root.is_file():
        return motions_of(root), {}
    loose = motion_files(root)
    inside = {composed(each.name): files for each in subfolders(root) if (files := motion_files(each))}
    if not loose and not inside:
        raise BenchError(f"{root} holds no motion files ({LAYOUTS}); it holds {contents(root)}")
    return loose, inside


def _target(target: Path) -> dict[str, Path]:
    aim = motions_of(target) if target.is_file() else motion_files(target)
    if not aim:
        raise BenchError(f"target {target} holds no motion files; it holds {contents(target)}")
    return aim


def _readable(files: Mapping[str, Path], entries: Mapping[Path, CatalogueEntry]) -> dict[str, Path]:
    return {clip: path for clip, path in files.items() if not entries[path].problem}


def _join(
    folders: Bodies, entries: Mapping[Path, CatalogueEntry]
) -> tuple[Bodies, dict[str, tuple[str, ...]]]:
    """Folders of one body's clips, as of one actor's styles, put together, and which these are; a body is
    named after its first folder.

    Folders with clips of the same name and length hold pairs, of two bodies that happen to be alike, and
    those of AMASS files are of a person each, whose bones a body model decides.
    """
    groups: dict[str, list[str]] = {}
    bones: dict[str, Hierarchy] = {}
    for name, clips in sorted(folders.items()):
        groups[name] = [name]
        first = next(iter(clips.values()))
        if format_of(first) is AMASS:
            continue
        with suppress(BenchError):  # whoever reads it says why it cannot be read
            bones[name] = hierarchy_of(first)
        for body in [each for each in groups if each != name and {each, name} <= bones.keys()]:
            pairs = any(_pairs(clips, folders[other], entries) for other in groups[body])
            if not pairs and _same_bones(bones[body], bones[name]):
                groups[body] += groups.pop(name)
                break
    bodies: Bodies = {}
    for body, names in groups.items():
        count = Counter(clip for name in names for clip in folders[name])
        bodies[body] = {
            clip if count[clip] == 1 else f"{name}-{clip}": path
            for name in names
            for clip, path in folders[name].items()
        }
    return bodies, {body: tuple(names) for body, names in groups.items() if len(names) > 1}


def _pairs(
    clips: Mapping[str, Path], others: Mapping[str, Path], entries: Mapping[Path, CatalogueEntry]
) -> bool:
    """Whether any clip has one of its name and length among the others."""
    same = clips.keys() & others.keys()
    return any(entries[clips[clip]].frames == entries[others[clip]].frames for clip in same)


def _group(loose: Mapping[str, Path], entries: Mapping[Path, CatalogueEntry], bodies: Bodies) -> None:
    """Loose files, put to the bodies that they show; a body is named after its first file."""
    models: dict[str, tuple[str, Hierarchy]] = {}
    for clip, path in loose.items():
        text = entries[path].hierarchy
        if text not in models:
            own = hierarchy_of(path)
            twin = next((name for name, other in models.values() if _same_bones(own, other)), None)
            models[text] = (twin or free_name(clip, bodies), own)
        bodies.setdefault(models[text][0], {})[clip] = path


def _same_bones(one: Hierarchy, other: Hierarchy) -> bool:
    """True where two files have one body: same joints, and bones that differ by rounding only.

    The offset of the root does not count, nor that of its only child, which may stand below a dummy root:
    many files put the first frame's place there.
    """
    if one.names != other.names or not np.array_equal(one.parents, other.parents):
        return False
    free = 2 if (one.parents == 0).sum() == 1 else 1
    bones, others = one.offsets[free:], other.offsets[free:]
    size = np.linalg.norm(bones, axis=1).max(initial=0.0)
    return bool(np.abs(bones - others).max(initial=0.0) <= ROUNDING * size)
