"""The motion files of a folder by name, and a catalogue of their bodies, lengths, rates and hashes, for BVH
made without parsing motion.

A data set of thousands of files must list its cases in the time that a command takes to start. So every
file is looked at once, and its entry is kept under the file's size and time of change.
"""

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from retarget_bench.errors import BenchError, FileError, some
from retarget_bench.files import cache_folder, composed, digest, read_sealed, write_sealed
from retarget_bench.motion import bvh
from retarget_bench.motion.bvh.document import Hierarchy, frame_rate
from retarget_bench.motion.character import resampled_frames
from retarget_bench.motion.files import format_of, read, split_take, suffixes, takes
from retarget_bench.motion.files.formats import BVH, FORMATS
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.recording import Recording, reach

VERSION = 2
_HEADER = re.compile(rb"^[ \t]*MOTION\s+Frames:\s*(\d+)\s+Frame Time:\s*(\S+)[ \t\r]*\n", re.MULTILINE)
_CHANNELS = re.compile(rb"\bCHANNELS[ \t]+(\d+)")
_DIGITS = 4
_NUMERIC = b"0123456789+-.eE \t\r\n"


@dataclass(frozen=True)
class CatalogueEntry:
    """Facts about one motion file, or one take of it.

    content:   SHA-256 of its bytes, of other formats than BVH also of its motion, in hexadecimal.
    hierarchy: a short hash of its hierarchy; files with the same one have the same body.
    frames:    its length; 0 where it cannot be read.
    fps:       frames per second, as the file states it.
    problem:   why it cannot be read, or "".
    """

    content: str
    hierarchy: str
    frames: int
    fps: float
    problem: str = ""

    def frames_at(self, fps: float) -> int:
        """Its length at another rate; 0 where it cannot be read."""
        return 0 if self.problem else resampled_frames(self.frames, self.fps, fps)


def catalogue(root: Path, files: Iterable[Path]) -> dict[Path, CatalogueEntry]:
    """An entry per file, in the order given; ``root`` names the cache.

    Files whose size and time of change are those of an earlier call are not opened. A file that cannot
    be read gets an entry with its ``problem``; nothing is raised for it.
    """
    place = cache_folder() / "catalogue" / f"{digest(str(root.resolve()), 16)}.json"
    key = f"catalogue {VERSION} {root.resolve()}"
    cached: dict[str, list] = json.loads(read_sealed(place, key) or b"{}")
    entries: dict[Path, CatalogueEntry] = {}
    record: dict[str, list] = {}
    for path in files:
        name = str(path.absolute() if "#" in path.name else path.resolve())
        stamp = _stamp(path)
        stored = cached.get(name)
        entry = CatalogueEntry(**stored[1]) if stored is not None and stored[0] == stamp else inspect(path)
        entries[path] = entry
        record[name] = [stamp, asdict(entry)]
    if any(cached.get(name) != stored for name, stored in record.items()):
        with suppress(FileError):  # a cache that cannot be written costs time, nothing else
            write_sealed(place, key, json.dumps({**cached, **record}).encode())
    return entries


def motion_files(folder: Path) -> dict[str, Path]:
    """The motions in a folder itself, by name, sorted, without hidden files.

    A file has its name without the ending, or all of it where another file has that. Of a file with
    several takes each has a name of its own, and a path with ``#`` (``motion.files.split_take``).
    Raises FileError where the folder cannot be listed.
    """
    listed = _visible(folder)
    motions: dict[str, Path] = {}
    alone = {path.suffix.lower() for path in listed}
    for form in FORMATS:
        if alone & {*form.suffixes} - {*form.bodies}:  # beside motions, bodies are no clips
            listed = [path for path in listed if path.suffix.lower() not in form.bodies]
    for path in listed:
        if path.suffix.lower() in suffixes() and path.is_file():
            stem, complete = composed(path.stem), composed(path.name)
            for name, one in motions_of(path).items():
                motions[name if name not in motions else complete + name.removeprefix(stem)] = one
    return dict(sorted(motions.items()))


def motions_of(path: Path) -> dict[str, Path]:
    """The motions of a file by composed names: ``{"walk": walk.bvh}``, ``{"Fox-Walk": Fox.glb#2, ...}``."""
    stem = composed(path.stem)
    names: tuple[str, ...] = ()
    with suppress(BenchError):  # whoever reads it says why it cannot be read
        names = takes(path)
    if len(names) < 2:
        return {stem: path}
    motions: dict[str, Path] = {}
    for number, name in enumerate(names, 1):
        plain = composed(name).replace("/", "_").strip() or str(number)
        free = plain if f"{stem}-{plain}" not in motions else f"{plain}-{number}"
        motions[f"{stem}-{free}"] = path.with_name(f"{path.name}#{number}")
    return motions


def bvh_files(folder: Path) -> dict[str, Path]:
    """The BVH files in a folder itself, by name without ``.bvh``, sorted, without hidden ones."""
    files = (each for each in _visible(folder) if each.suffix.lower() == ".bvh" and each.is_file())
    return {each.stem: each for each in files}


def subfolders(folder: Path) -> list[Path]:
    """The folders in a folder, sorted, without hidden ones."""
    return [each for each in _visible(folder) if each.is_dir()]


def contents(folder: Path) -> str:
    """The contents of a folder in a few words, for messages."""
    names = [each.name for each in _visible(folder)]
    return some(names) if names else "nothing"


def existing(path: Path) -> Path:
    """``path`` itself; raises BenchError where nothing is there, saying what lies near it."""
    if path.exists():
        return path
    nearest = next((each for each in path.parents if each.is_dir()), Path())
    raise BenchError(f"there is no folder or file {path}; {nearest} exists and holds {contents(nearest)}")


def _visible(folder: Path) -> list[Path]:
    try:
        return sorted(each for each in folder.iterdir() if not each.name.startswith("."))
    except OSError as error:
        raise FileError(folder, f"cannot be listed ({error.strerror or error})") from error


def inspect(path: Path, rate: float | None = None) -> CatalogueEntry:
    """One file's entry, from its bytes. rate: frames per second of a file that states none.

    The motion block is checked by its outline only: number of lines, numbers in the last line, nothing
    but numbers. Whatever looks odd is handed to the real parser, which has the last word.
    """
    if format_of(path) is not BVH:
        return _of_other_format(path, rate)
    try:
        data = path.read_bytes()
    except OSError as error:
        return CatalogueEntry("", "", 0, 0.0, f"cannot be read ({error.strerror or error})")
    content = hashlib.sha256(data).hexdigest()
    match = _HEADER.search(data)
    body = data[match.end() :].strip() if match else b""
    header = data[: match.start() if match else 0]
    hierarchy = hashlib.sha256(b" ".join(header.split())).hexdigest()[:16]
    with suppress(ValueError):  # numbers of thousands of digits among others
        complete = match and _seems_complete(header, body, int(match[1]))
        if match and complete and 1e-4 < (seconds := float(match[2])) < 10.0:
            return CatalogueEntry(content, hierarchy, int(match[1]), frame_rate(seconds))
    try:
        recording = bvh.read(path, inner=True, rate=rate)
    except BenchError as error:
        return CatalogueEntry(content, hierarchy, 0, 0.0, _problem(error))
    return CatalogueEntry(content, hierarchy, len(recording.root), recording.fps)


def _of_other_format(path: Path, rate: float | None) -> CatalogueEntry:
    try:
        return CatalogueEntry(*facts(path, rate))
    except BenchError as error:
        return CatalogueEntry("", "", 0, 0.0, _problem(error))
    except OSError as error:
        return CatalogueEntry("", "", 0, 0.0, f"cannot be read ({error.strerror or error})")


def _problem(error: BenchError) -> str:
    problem = error.problem if isinstance(error, FileError) else str(error)
    return f"line {error.line}: {problem}" if isinstance(error, FileError) and error.line else problem


def hierarchy_of(path: Path) -> Hierarchy:
    """The joints of a file: names, parents and offsets. Raises FileError."""
    if format_of(path) is BVH:
        return bvh.parse_header(path).hierarchy
    recording = read(path)
    skeleton = recording.skeleton
    channels: tuple[tuple[str, ...], ...] = ((),) * len(skeleton)
    return Hierarchy(skeleton.names, skeleton.parents, _bones(recording), channels, skeleton.end_sites)


def _bones(recording: Recording) -> np.ndarray:
    """``(joints, 3)`` what tells bodies apart: offsets; of joint positions lengths alone, since each clip
    shows how bones lie to each other a little differently."""
    skeleton = recording.skeleton
    if recording.positions is None:
        return skeleton.offsets
    return skeleton.bone_lengths[:, None] * np.array([1.0, 0.0, 0.0])


def facts(path: Path, rate: float | None = None) -> tuple[str, str, int, float]:
    """Of a file that is no BVH: hashes of its bytes and motion, and of its skeleton; frames; their rate.

    rate: that of a file that states none, or one that is none.
    Raises FileError, or NotSupported where the take in the path is not there.
    """
    own, take = split_take(path)
    recording = read(path, Reading(rate=rate))
    content = hashlib.sha256(own.read_bytes() + repr(take).encode())
    values = recording.rotations if recording.positions is None else recording.positions
    for array in (values, recording.root, recording.skeleton.offsets):
        content.update(np.ascontiguousarray(array).tobytes())  # of the files that it refers to
    skeleton = recording.skeleton
    bones = np.round(_bones(recording)[1:] / max(reach(skeleton), 1e-9), _DIGITS) + 0.0
    text = repr((skeleton.names, skeleton.parents.tolist(), bones.tolist()))
    hierarchy = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]
    return content.hexdigest(), hierarchy, len(recording.root), recording.fps


def fingerprint(entries: Mapping[str, CatalogueEntry]) -> str:
    """A hash of file names and contents: what identifies a data set of these files in keys."""
    lines = (f"{name}\t{entry.content}" for name, entry in sorted(entries.items()))
    return "sha256:" + digest("\n".join(lines), 32)


def by_name(
    files: Mapping[str, Mapping[str, Path]], entries: Mapping[Path, CatalogueEntry]
) -> dict[str, CatalogueEntry]:
    """``body/clip`` -> entry. files: body -> clip -> file."""
    return {f"{body}/{clip}": entries[path] for body, own in files.items() for clip, path in own.items()}


def _seems_complete(header: bytes, body: bytes, frames: int) -> bool:
    channels = sum(int(count) for count in _CHANNELS.findall(header))
    return (
        frames > 0
        and b"HIERARCHY" in header
        and body.count(b"\n") + 1 == frames
        and not body.translate(None, _NUMERIC)
        and len(body[body.rfind(b"\n") + 1 :].split()) == channels
    )


def _stamp(path: Path) -> list[int]:
    own = split_take(path)[0]
    form = next((form for form in FORMATS if own.suffix.lower() in form.suffixes), BVH)
    try:
        stats = [each.stat() for each in (own, *form.beside(own))]
    except OSError:
        return [0, 0]
    return [number for status in stats for number in (status.st_size, status.st_mtime_ns)]
