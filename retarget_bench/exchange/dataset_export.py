"""Export of a data set: motions, labels, a manifest and check sums."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench import __version__
from retarget_bench.api import CaseInfo, Dataset, Prediction, optional
from retarget_bench.errors import BenchError, FileError, NotSupported
from retarget_bench.files import read_json, slug, write_text
from retarget_bench.motion import bvh
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import runs
from retarget_bench.motion.files.gltf import writing as gltf
from retarget_bench.motion.motion import Motion

SCHEMA = 1
MANIFEST, SUMS, JOURNAL = "manifest.json", "SHA256SUMS", "unfinished.txt"
SCALE = 100.0
FORMS = {
    "bvh": "BVH in centimetres, Y up; angles in degrees, channels in the order that each file names.",
    "glb": "GLB (glTF 2.0) in metres, Y up, with the character's mesh where it has one.",
}
"""Ending -> how motions are written."""
CONVENTIONS = (
    "Characters face +Z, left is +X. A file under characters/ stands in the reference pose (T-pose) that "
    "the character's motions are relative to. Labels are stretches [first frame, frame after the last]. A "
    "case asks for the motion of 'target' that does what 'source_file' does; 'reference_file' is the right "
    "answer, and 'alternative_file' another that is as right. Check: sha256sum -c SHA256SUMS"
)


@dataclass
class _Folder:
    """The folder that is written, and what is in it already: path -> (check sum, bytes).

    form: the ending of motion files.
    """

    path: Path
    head: str
    form: str = "bvh"
    done: dict[str, tuple[str, int]] = field(default_factory=dict)

    @classmethod
    def open(cls, path: Path, head: str, form: str) -> _Folder:
        """A new folder, or one that holds (part of) the same export. Raises BenchError for any other."""
        folder = cls(path, head, form)
        if path.exists() and not path.is_dir():
            raise BenchError(f"{path} is a file; name a folder")
        if (path / JOURNAL).exists():
            folder._take_up()
        elif (path / MANIFEST).exists():
            folder._look_through()
        elif path.exists() and any(path.iterdir()):
            raise BenchError(f"{path} is not empty and holds no export; name a new or empty folder")
        lines = [f"{total} {size} {name}\n" for name, (total, size) in folder.done.items()]
        write_text(path / JOURNAL, f"{head}\n{''.join(lines)}")
        return folder

    def _take_up(self) -> None:
        """Files that an interrupted export finished; a line that was cut off is ignored."""
        head, *lines = (self.path / JOURNAL).read_text(encoding="utf-8").split("\n")
        self._same(head)
        for line in lines[:-1]:
            total, size, name = line.split(" ", 2)
            file = self.path / name
            if file.is_file() and file.stat().st_size == int(size):
                self.done[name] = (total, int(size))

    def _look_through(self) -> None:
        """Files of a finished export that are still what they were."""
        try:
            manifest = read_json(self.path / MANIFEST)
            self._same(str(manifest["export"]))
            listed = dict(manifest["files"])
        except (FileError, ValueError, KeyError, TypeError) as error:
            raise BenchError(
                f"{self.path / MANIFEST} is no manifest of an export; name a new folder"
            ) from error
        for name, known in listed.items():
            file = self.path / name
            if file.is_file() and checksum(file) == known["sha256"]:
                self.done[name] = (known["sha256"], known["bytes"])

    def _same(self, head: str) -> None:
        if head != self.head:
            raise BenchError(f"{self.path} holds another export ({head}); name a new folder")

    def add(self, name: str, write: Callable[[Path], None]) -> None:
        """Write a file that is not there yet, and note its check sum."""
        if name in self.done:
            return
        file = self.path / name
        write(file)
        self.done[name] = (checksum(file), file.stat().st_size)
        try:
            with (self.path / JOURNAL).open("a", encoding="utf-8", newline="\n") as journal:
                journal.write(f"{self.done[name][0]} {self.done[name][1]} {name}\n")
        except OSError as error:
            raise FileError(self.path / JOURNAL, f"cannot be written ({error.strerror})") from error

    def finish(self, manifest: Mapping[str, Any]) -> None:
        files = {
            name: {"sha256": total, "bytes": size} for name, (total, size) in sorted(self.done.items())
        }
        whole = {"export": self.head, **manifest, "files": files}
        write_text(self.path / MANIFEST, json.dumps(whole, indent=1, ensure_ascii=False) + "\n")
        sums = {name: known["sha256"] for name, known in files.items()}
        sums[MANIFEST] = checksum(self.path / MANIFEST)
        write_text(self.path / SUMS, "".join(f"{total}  {name}\n" for name, total in sums.items()))
        (self.path / JOURNAL).unlink()


def export(data: Dataset, name: str, folder: Path, form: str = "bvh") -> Iterator[tuple[int, int]]:
    """Write a data set to a folder; yields (done, of how many) after every case and training clip.

    form: ``bvh`` or ``glb``.

    What an earlier, interrupted call wrote is kept. A data set may have ``parts()`` (name -> data set),
    ``training()`` (structure -> character -> motions with ``names``) and ``labels(info)``; all are written.
    Raises BenchError where the folder holds something else, NotSupported for motions without rotations.
    """
    head = f"retarget-bench export of {name}: {data.content}"
    target = _Folder.open(folder, head if form == "bvh" else f"{head} as {form}", form)
    parts = optional.parts(data)
    listed = [
        (part, each, info)
        for part, each in parts.items()
        for split in each.card.splits
        for info in each.cases("retarget", split)
    ]
    training = [
        (structure, character, clips, number)
        for structure, mine in optional.training(data).items()
        for character, clips in mine.items()
        for number in range(len(clips))
    ]
    total = len(listed) + len(training)
    characters = _characters(target, data)
    cases = []
    for count, (part, each, info) in enumerate(listed, 1):
        cases.append(_case(target, each, part, info))
        yield count, total
    trained = []
    for count, (structure, character, clips, number) in enumerate(training, len(listed) + 1):
        clip = clips.names[number]
        file = f"training/{slug(structure)}/{slug(character)}/{slug(clip)}.{form}"
        target.add(file, lambda path, clips=clips, number=number: _write(path, clips[number]))  # type: ignore[misc]
        trained.append({"structure": structure, "character": character, "clip": clip, "file": file})
        yield count, total
    target.finish(
        {
            "schema": SCHEMA,
            "made_by": f"retarget-bench {__version__}",
            "dataset": name,
            "label": data.label,
            "version": data.card.version,
            "licence": data.card.licence,
            "content": data.content,
            "conventions": f"{FORMS[form]} {CONVENTIONS}",
            "notes": list(data.notes),
            "characters": characters,
            "cases": cases,
            "training": trained,
        }
    )


def _characters(target: _Folder, data: Dataset) -> list[dict[str, Any]]:
    found = []
    for name, body in data.characters().items():
        file = f"characters/{slug(name)}.{target.form}"
        target.add(file, lambda path, body=body: _write(path, standing(body)))  # type: ignore[misc]
        height = round(float(body.height), 6)
        found.append({"name": name, "structure": body.structure, "height": height, "file": file})
    return found


def standing(body: Character) -> Motion:
    """A frame of the reference pose on the floor."""
    root = np.array([[0.0, body.measures.hip_height, 0.0]])
    return body.motion(body.reference_pose[None], root, fps=30.0)


def _case(target: _Folder, data: Dataset, part: str, info: CaseInfo) -> dict[str, Any]:
    """Write what a case needs and is not there; its row of the manifest."""
    stem, clip = f"{slug(info.clip)}/{slug(info.target)}", slug(info.clip)
    files = {
        "source_file": f"motions/{clip}/{slug(info.source)}.{target.form}",
        "reference_file": f"motions/{stem}.{target.form}",
        "alternative_file": f"alternatives/{stem}.{target.form}",
        "labels_file": f"labels/{stem}.json",
    }
    if not set(files.values()) <= set(target.done):
        case = data.load(info)
        for kind in ("source", "reference", "alternative"):
            motion = getattr(case, kind)
            if motion is not None:
                target.add(files[f"{kind}_file"], lambda path, motion=motion: _write(path, motion))  # type: ignore[misc]
        if known := _labels(data, info, case.contacts):
            text = json.dumps(known) + "\n"
            target.add(files["labels_file"], lambda path: write_text(path, text))
    present = {key: file for key, file in files.items() if file in target.done}
    row = {**asdict(info), **present}
    if isinstance(data, optional.OffersUnseen):
        row["not_in_training"] = sorted(data.unseen(info))
    return {"part": part, **row} if part else row


def _labels(data: Dataset, info: CaseInfo, contacts: Any) -> dict[str, Any]:
    """Contacts, and whatever else the data set knows of every frame."""
    found: dict[str, Any] = {}
    if contacts is not None:
        for name in ("planted", "pivoting"):
            if (label := getattr(contacts, name)) is not None:
                columns = zip(contacts.roles, np.asarray(label).T, strict=True)
                found[name] = {role: runs(column).tolist() for role, column in columns}
    if isinstance(data, optional.OffersLabels):
        known = data.labels(info)
        starts = [0, *(np.flatnonzero(known.kind[1:] != known.kind[:-1]) + 1).tolist(), len(known.kind)]
        found["kind"] = [[str(known.kind[first]), first, end] for first, end in pairwise(starts)]
        found["phase"] = [round(float(value), 4) for value in known.phase]
        found["touches"] = {name: runs(label).tolist() for name, label in known.touches.items()}
    return found


def _write(path: Path, motion: Prediction) -> None:
    if not isinstance(motion, Motion):
        raise NotSupported(
            f"{motion.character.name} is known by joint positions only; motion files need rotations"
        )
    if path.suffix == ".bvh":
        bvh.write(path, motion, scale=SCALE)
    else:
        gltf.write(path, motion)


def checksum(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
