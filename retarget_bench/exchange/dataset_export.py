"""Export of a data set: motions, labels, a manifest and check sums."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import CaseInfo, Dataset, Prediction
from retarget_bench.api.completing import complete
from retarget_bench.errors import BenchError, FileError, NotSupported
from retarget_bench.exchange.case_export import MANIFEST, manifest_facts, standing
from retarget_bench.files import read_json, slug, write_text
from retarget_bench.motion import bvh
from retarget_bench.motion.contact import runs
from retarget_bench.motion.files.gltf import writing as gltf
from retarget_bench.motion.motion import Motion

SUMS = "SHA256SUMS"
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
    """The folder that is written, the manifest and then ``SHA256SUMS`` last.

    Files appear when they are whole, so that an interrupted export goes on with those that are not there.
    Until all are, the manifest says only which export they are of.

    form:    the ending of motion files.
    damaged: files of a finished export that are no longer what they were.
    """

    path: Path
    form: str
    damaged: set[str]

    @classmethod
    def open(cls, path: Path, head: str, form: str) -> _Folder:
        """A new folder, or one that holds (part of) the same export. Raises BenchError for any other."""
        if path.exists() and not path.is_dir():
            raise BenchError(f"{path} is a file; name a folder")
        if (path / MANIFEST).exists():
            if (other := _head(path / MANIFEST)) != head:
                raise BenchError(f"{path} holds another export ({other}); name a new folder")
        elif path.exists() and any(path.iterdir()):
            raise BenchError(f"{path} is not empty and holds no export; name a new or empty folder")
        else:
            write_text(path / MANIFEST, json.dumps({"export": head}) + "\n")
        lines = (path / SUMS).read_text(encoding="utf-8").splitlines() if (path / SUMS).exists() else []
        listed = ((name, total) for total, _, name in (line.partition("  ") for line in lines))
        return cls(path, form, {name for name, total in listed if _checksum(path / name) != total})

    def has(self, name: str) -> bool:
        """Whether a file is there, as it was written."""
        return name not in self.damaged and (self.path / name).exists()

    def add(self, name: str, content: Prediction | str) -> None:
        """Write a motion or a text that is not there yet."""
        if self.has(name):
            return
        if isinstance(content, str):
            write_text(self.path / name, content)
        elif not isinstance(content, Motion):
            problem = f"{content.character.name} is known by joint positions only"
            raise NotSupported(f"{problem}; motion files need rotations")
        elif self.form == "bvh":
            bvh.write(self.path / name, content, scale=SCALE)
        else:
            gltf.write(self.path / name, content)
        self.damaged.discard(name)

    def finish(self, manifest: Mapping[str, Any], names: Iterable[str]) -> None:
        """Write the manifest, and the check sums of these files and of it."""
        write_text(self.path / MANIFEST, json.dumps(manifest, indent=1, ensure_ascii=False) + "\n")
        sums = [f"{_checksum(self.path / name)}  {name}\n" for name in (*sorted(set(names)), MANIFEST)]
        write_text(self.path / SUMS, "".join(sums))


def _head(path: Path) -> str:
    """The export that a manifest is of."""
    try:
        return str(read_json(path)["export"])
    except (FileError, KeyError, TypeError) as error:
        raise BenchError(f"{path} is not the manifest of an export; name a new folder") from error


def _checksum(path: Path) -> str:
    """SHA-256 of a file; "" where there is none."""
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def export(data: Dataset, name: str, folder: Path, form: str = "bvh") -> Iterator[tuple[int, int]]:
    """Write a data set to a folder; yields (done, of how many) after every case and training clip.

    form: ``bvh`` or ``glb``.

    What an earlier, interrupted call wrote is kept. A data set may have ``parts()`` (name -> data set),
    ``training()`` (structure -> character -> motions with ``names``) and ``labels(info)``; all are written.
    Raises BenchError where the folder holds something else, NotSupported for motions without rotations.
    """
    head = f"retarget-bench export of {name}: {data.content}" + ("" if form == "bvh" else f" as {form}")
    target = _Folder.open(folder, head, form)
    parts = {part: complete(each, Dataset) for part, each in data.parts().items()}
    listed = [
        (part, each, info)
        for part, each in parts.items()
        for split in each.card.splits
        for info in each.cases("retarget", split)
    ]
    training = [
        (structure, character, clips, number)
        for structure, characters_of in data.training().items()
        for character, clips in characters_of.items()
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
        if not target.has(file):
            target.add(file, clips[number])
        trained.append({"structure": structure, "character": character, "clip": clip, "file": file})
        yield count, total
    manifest = {
        "export": head,
        **manifest_facts(data, name, f"{FORMS[form]} {CONVENTIONS}"),
        "label": data.label,
        "notes": list(data.notes),
        "characters": characters,
        "cases": cases,
        "training": trained,
    }
    rows = (*characters, *cases, *trained)
    target.finish(manifest, (row[key] for row in rows for key in row if key.endswith("file")))


def _characters(target: _Folder, data: Dataset) -> list[dict[str, Any]]:
    rows = []
    for name, body in data.characters().items():
        file = f"characters/{slug(name)}.{target.form}"
        target.add(file, standing(body))
        height = round(float(body.height), 6)
        rows.append({"name": name, "structure": body.structure, "height": height, "file": file})
    return rows


def _case(target: _Folder, data: Dataset, part: str, info: CaseInfo) -> dict[str, Any]:
    """Write what a case needs and is not there; its row of the manifest."""
    stem, clip = f"{slug(info.clip)}/{slug(info.target)}", slug(info.clip)
    files = {
        "source_file": f"motions/{clip}/{slug(info.source)}.{target.form}",
        "reference_file": f"motions/{stem}.{target.form}",
        "alternative_file": f"alternatives/{stem}.{target.form}",
        "labels_file": f"labels/{stem}.json",
    }
    if not all(map(target.has, files.values())):
        case = data.load(info)
        for kind in ("source", "reference", "alternative"):
            if (motion := getattr(case, kind)) is not None:
                target.add(files[f"{kind}_file"], motion)
        if labels := _labels(data, info, case.contacts):
            target.add(files["labels_file"], json.dumps(labels) + "\n")
    present = {key: file for key, file in files.items() if target.has(file)}
    row = {**asdict(info), **present}
    if (unseen := data.unseen(info)) is not None:
        row["not_in_training"] = sorted(unseen)
    return {"part": part, **row} if part else row


def _labels(data: Dataset, info: CaseInfo, contacts: Any) -> dict[str, Any]:
    """Labels of every frame: contacts, and those that the data set offers."""
    facts: dict[str, Any] = {}
    if contacts is not None:
        for name in ("planted", "pivoting"):
            if (label := getattr(contacts, name)) is not None:
                columns = zip(contacts.roles, np.asarray(label).T, strict=True)
                facts[name] = {role: runs(column).tolist() for role, column in columns}
    if (labels := data.labels(info)) is not None:
        starts = [0, *(np.flatnonzero(labels.kind[1:] != labels.kind[:-1]) + 1).tolist(), len(labels.kind)]
        facts["kind"] = [[str(labels.kind[first]), first, end] for first, end in pairwise(starts)]
        facts["phase"] = [round(float(value), 4) for value in labels.phase]
        facts["touches"] = {name: runs(label).tolist() for name, label in labels.touches.items()}
    return facts
