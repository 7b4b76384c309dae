"""Sources and targets of the command line as a list of jobs."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from retarget_bench.commands.motion_files import MotionFile
from retarget_bench.commands.retargeting.job import Job, Options
from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion.files import format_of, split_take, suffixes, takes
from retarget_bench.motion.files.catalogue import motion_files
from retarget_bench.motion.importer import load
from retarget_bench.motion.scans.reading import SUFFIXES as SCANS
from retarget_bench.python.scans import check_pair


def holds_motions(path: Path) -> bool:
    """True for a folder that holds motion files: BVH and the like, or GLB files with animations. Folders
    of other mesh files are scans."""
    if not path.is_dir():
        return False
    paths = [each for each in path.iterdir() if each.suffix.lower() in suffixes()]
    own = [each for each in paths if each.suffix.lower() not in SCANS]
    return bool(own) or any(_animated(each) for each in sorted(paths)[:1])


def _animated(path: Path) -> bool:
    try:
        return bool(takes(path))
    except BenchError:
        return False


def are_scans(sources: Sequence[MotionFile], targets: Sequence[MotionFile]) -> bool:
    """True for a scan and a mesh. Raises BenchError where one is of that kind and the other is not."""
    source, target = sources[0].path, targets[0].path
    alone = len(sources) == len(targets) == 1 and not holds_motions(source)
    if alone and source.is_dir() and not any(each.is_file() for each in source.iterdir()):
        raise FileError(source, "has no motion files, and has no frames of a scan")
    return alone and check_pair(source, target)


def is_many(sources: Sequence[MotionFile], targets: Sequence[MotionFile], out: str) -> bool:
    """True where results go into a folder: there are several, or a folder is given, or a name that ends in
    a slash."""
    files = [*sources, *targets]
    folder = out.endswith(("/", os.sep)) or _is_folder(Path(out))
    return len(files) > 2 or any(each.path.is_dir() for each in files) or folder


def _is_folder(path: Path) -> bool:
    with suppress(OSError):  # of a name that is too long
        return path.is_dir()
    return False


def jobs(sources: Sequence[MotionFile], targets: Sequence[MotionFile], options: Options) -> list[Job]:
    """A job for every source on every target, into a folder.

    Results are ``OUT/TARGET/SOURCE.ext``, of one target ``OUT/SOURCE.ext``. Raises BenchError.
    """
    out = Path(options.out)
    if out.suffix.lower() in suffixes() or out.is_file():
        raise BenchError(f"{out}: several results go into a folder; give -o the name of a folder")
    for each in sources:
        if each.path.is_dir() and out.exists() and out.samefile(each.path):
            raise BenchError(f"{out} holds the sources; choose another folder for the results")
    performers = _named(sources, of_takes=True)
    bodies = _named(targets, of_takes=False)
    listed = []
    for name, target in bodies.items():
        suffix = _suffix(target, options.format)
        folder = out if len(bodies) == 1 else out / name
        for stem, source in performers.items():
            result = folder / f"{stem}{suffix}"
            preview = preview_of(options.preview, result, several=True)
            listed.append(Job(source, target, result, options, preview))
    return listed


def preview_of(preview: Path | None, out: Path, *, several: bool) -> Path | None:
    """The file of a result's preview.

    preview: a file, or an ending alone (``mp4``), for one beside the result. Raises BenchError for another
    ending, and for a file where there are several results.
    """
    if preview is None:
        return None
    from retarget_bench.viewer import clips

    endings, ending = [each.lstrip(".") for each in clips.ENDINGS], str(preview).lstrip(".").lower()
    if ending in endings:
        preview = out.with_name(f"{out.stem}.preview.{ending}")
    elif several:
        raise BenchError(
            f"--preview {preview}: several results have a preview each, beside them; say what it is: "
            f"{', '.join(endings)}"
        )
    clips.ending(preview)
    return preview


def _named(files: Sequence[MotionFile], *, of_takes: bool) -> dict[str, MotionFile]:
    """Name -> file, of files and of those in folders; where two are named alike with their folder's name
    before it. of_takes: each motion of a file in a folder by itself, unless its reading names one. Raises
    BenchError."""
    entries: list[tuple[str, MotionFile]] = []
    for each in files:
        path = each.path
        if not path.is_dir():
            own, take = split_take(path)
            entries.append((f"{own.stem}-{take.replace('/', '_')}" if take else own.stem, each))
            continue
        inside = motion_files(path)
        if not inside:
            endings = ", ".join(suffixes())
            raise FileError(path, f"has no motion files; they end in {endings}, folders in it are not read")
        if not of_takes or each.reading.take is not None:
            inside = _without_takes(inside.values())
        entries += [(name, replace(each, path=file)) for name, file in inside.items()]
    counts = _counted(name for name, _ in entries)
    entries = [
        (name if counts[name.casefold()] == 1 else f"{each.path.resolve().parent.name}-{name}", each)
        for name, each in entries
    ]
    for name, many in _counted(name for name, _ in entries).items():
        if many > 1:
            both = ", ".join(str(file.path) for each, file in entries if each.casefold() == name)
            raise BenchError(f"{both} would give results of one name; rename one, or give one run for each")
    return dict(entries)


def _without_takes(paths: Iterable[Path]) -> dict[str, Path]:
    """Files themselves, whatever takes they have; with their ending where two have one stem."""
    own = dict.fromkeys(split_take(path)[0] for path in paths)
    counts = _counted(path.stem for path in own)
    return {(path.stem if counts[path.stem.casefold()] == 1 else path.name): path for path in own}


def _counted(names: Iterable[str]) -> Counter[str]:
    return Counter(name.casefold() for name in names)


def _suffix(target: MotionFile, ending: str | None) -> str:
    """The ending of results: ``.bvh``, ``.glb``, ... Raises BenchError for a format that is not written."""
    written = suffixes(written=True)
    if ending is not None:
        if (suffix := f".{ending.lower().lstrip('.')}") not in written:
            endings = ", ".join(each[1:] for each in written)
            raise BenchError(f"--format {ending}: results are written as {endings}")
        return suffix
    form = format_of(target.path)
    return form.written[0] if form.written else _usual(target)


def _usual(target: MotionFile) -> str:
    """GLB for a character with a mesh, else BVH."""
    try:
        meshed = load(target.path, target.reading).motion.character.mesh is not None
    except BenchError:  # its jobs say why
        meshed = False
    return ".glb" if meshed else ".bvh"
