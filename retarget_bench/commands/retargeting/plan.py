"""Sources and targets of the command line as a list of jobs."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from retarget_bench.commands.retargeting import previews
from retarget_bench.commands.retargeting.job import Job
from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion import files as formats
from retarget_bench.motion import importer
from retarget_bench.motion.files.listing import motion_files
from retarget_bench.motion.scans.reading import SUFFIXES as SCANS
from retarget_bench.python.scans import check_pair


def holds_motions(path: Path) -> bool:
    """True for a folder that holds motion files: BVH and the like, or GLB files with animations. Folders
    of other mesh files are scans."""
    if not path.is_dir():
        return False
    found = [each for each in path.iterdir() if each.suffix.lower() in formats.suffixes()]
    own = [each for each in found if each.suffix.lower() not in SCANS]
    return bool(own) or any(_animated(each) for each in sorted(found)[:1])


def _animated(path: Path) -> bool:
    try:
        return bool(formats.takes(path))
    except BenchError:
        return False


def are_scans(sources: Sequence[Path], targets: Sequence[Path]) -> bool:
    """True for a scan and a mesh. Raises BenchError where one is of that kind and the other is not."""
    alone = len(sources) == len(targets) == 1 and not holds_motions(sources[0])
    if alone and sources[0].is_dir() and not any(each.is_file() for each in sources[0].iterdir()):
        raise FileError(sources[0], "has no motion files, and has no frames of a scan")
    return alone and check_pair(sources[0], targets[0])


def is_many(sources: Sequence[Path], targets: Sequence[Path], out: str) -> bool:
    """True where results go into a folder: there are several, or a folder is given, or a name that ends in
    a slash."""
    given = [*sources, *targets]
    folder = out.endswith(("/", os.sep)) or _is_folder(Path(out))
    return len(given) > 2 or any(each.is_dir() for each in given) or folder


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # of a name that is too long
        return False


def jobs(
    sources: Sequence[Path], targets: Sequence[Path], like: Job, ending: str | None, preview: Path | None
) -> list[Job]:
    """A job for every source on every target, as ``like`` but for its files, whose ``out`` is the folder.

    Results are ``OUT/TARGET/SOURCE.ext``, of one target ``OUT/SOURCE.ext``. ending: of results, without
    dot; None: of the target's own format, where it can be written. Raises BenchError.
    """
    _check_folder(like.out, sources)
    performers = _listed(sources, takes=like.options.get("take") is None)
    bodies = _listed(targets, takes=False)
    found = []
    for name, target in bodies.items():
        suffix = _suffix(target, ending)
        folder = like.out if len(bodies) == 1 else like.out / name
        for stem, source in performers.items():
            out = folder / f"{stem}{suffix}"
            shown = previews.path_of(preview, out, several=True)
            found.append(replace(like, source=source, target=target, out=out, preview=shown))
    return found


def _check_folder(out: Path, sources: Sequence[Path]) -> None:
    if out.suffix.lower() in formats.suffixes() or out.is_file():
        raise BenchError(f"{out}: several results go into a folder; give -o the name of a folder")
    for each in sources:
        if each.is_dir() and out.exists() and out.samefile(each):
            raise BenchError(f"{out} holds the sources; choose another folder for the results")


def _listed(given: Sequence[Path], *, takes: bool) -> dict[str, Path]:
    """Name -> file, of files and of those in folders; where two are named alike with their folder's name
    before it. takes: each motion of a file in a folder by itself. Raises BenchError."""
    found: list[tuple[str, Path]] = []
    for path in given:
        if not path.is_dir():
            own, take = formats.split_take(path)
            found.append((f"{own.stem}-{take.replace('/', '_')}" if take else own.stem, path))
            continue
        inside = motion_files(path)
        if not inside:
            known = ", ".join(formats.suffixes())
            raise FileError(path, f"has no motion files; they end in {known}, folders in it are not read")
        found += inside.items() if takes else _files(inside.values())
    counts = _counted(name for name, _ in found)
    named = [(n if counts[n.casefold()] == 1 else f"{_folder(p)}-{n}", p) for n, p in found]
    for name, many in _counted(name for name, _ in named).items():
        if many > 1:
            both = ", ".join(str(path) for each, path in named if each.casefold() == name)
            raise BenchError(f"{both} would give results of one name; rename one, or give one run for each")
    return dict(named)


def _files(paths: Iterable[Path]) -> list[tuple[str, Path]]:
    """Files themselves, whatever takes they have; with their ending where two have one stem."""
    own = dict.fromkeys(formats.split_take(path)[0] for path in paths)
    counts = _counted(path.stem for path in own)
    return [(path.stem if counts[path.stem.casefold()] == 1 else path.name, path) for path in own]


def _counted(names: Iterable[str]) -> Counter[str]:
    return Counter(name.casefold() for name in names)


def _folder(path: Path) -> str:
    return path.resolve().parent.name


def _suffix(target: Path, ending: str | None) -> str:
    """``.bvh``, ``.glb``, ... Raises BenchError where results cannot be written so."""
    written = formats.suffixes(written=True)
    if ending is not None:
        if (found := f".{ending.lower().lstrip('.')}") not in written:
            known = ", ".join(each[1:] for each in written)
            raise BenchError(f"--format {ending}: results are written as {known}")
        return found
    form = formats.format_of(target)
    return form.written[0] if form.written else _usual(target)


def _usual(target: Path) -> str:
    """GLB for a character with a mesh, else BVH."""
    try:
        meshed = importer.load(target).motion.character.mesh is not None
    except BenchError:  # its jobs say why
        meshed = False
    return ".glb" if meshed else ".bvh"
