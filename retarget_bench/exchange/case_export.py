"""Export of cases for prediction by other programs: sources, target characters and a manifest."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench import __version__
from retarget_bench.api import CaseInfo, Dataset, PointSets, Source
from retarget_bench.files import atomic, slug, write_text
from retarget_bench.motion import bvh
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.results import store

SCHEMA = 1
MANIFEST = "manifest.json"
CONVENTIONS = (
    "Metres, Y up, characters face +Z, left is +X. Rotations are local unit quaternions (frames, joints, "
    "4), w first; root (frames, 3) is the root joint's place in the world. For every case write a motion "
    "of its target with the source's frames and rate, named as 'prediction' says, beside this file: .npz "
    "with rotations and root, or with positions (frames, joints, 3); or .bvh with the target's hierarchy."
)


def export(data: Dataset, name: str, infos: Sequence[CaseInfo], folder: Path) -> Iterator[int]:
    """Write the cases' inputs to a folder, the manifest last; yields after every case.

    name: the data set's spec, by which ``bench score`` finds the references again. A source that several
    cases share, and a target, are written once. Raises FileError where the folder cannot be written.
    """
    sources: dict[tuple[str, str], dict[str, Any]] = {}
    targets: dict[str, str] = {}
    cases = []
    for done, info in enumerate(infos, 1):
        played = (info.source, info.clip)
        if played not in sources or info.target not in targets:
            case = data.load(info)
            if played not in sources:
                sources[played] = write_source(folder, f"{info.source}--{info.clip}", case.source)
            if info.target not in targets:
                targets[info.target] = write_target(folder, case.target.name, case.target)
        source = sources[played]
        cases.append(
            {
                **asdict(info),
                "frames": source["frames"],
                "fps": source["fps"],
                "source_file": source["file"],
                "target_file": targets[info.target],
                "prediction": store.case_file(info.id),
            }
        )
        yield done
    facts = manifest_facts(data, name, CONVENTIONS) | {"cases": cases}
    write_text(folder / MANIFEST, json.dumps(facts, indent=1, ensure_ascii=False) + "\n")


def manifest_facts(data: Dataset, name: str, conventions: str) -> dict[str, Any]:
    """Facts of a data set in every manifest of an export. name: the data set's spec."""
    return {
        "schema": SCHEMA,
        "made_by": f"retarget-bench {__version__}",
        "dataset": name,
        "version": data.card.version,
        "licence": data.card.licence,
        "content": data.content,
        "conventions": conventions,
    }


def write_source(folder: Path, name: str, source: Source) -> dict[str, Any]:
    """Write a source motion; its file without suffix, relative to the folder, and its length."""
    file = f"sources/{slug(name)}"
    if isinstance(source, Motion):
        data = {"rotations": source.rotations, "root": source.root}
        bvh.write(folder / f"{file}.bvh", source)
    elif isinstance(source, PointSets):
        data = {"points": np.concatenate(source.points), "counts": source.counts}
    else:
        data = {"positions": source.positions}
    _save(folder / f"{file}.npz", source.character, **data, fps=source.fps)
    return {"file": file, "frames": source.frames, "fps": source.fps}


def write_target(folder: Path, name: str, target: Character) -> str:
    """Write a target's body, standing in the reference pose in its BVH file; the file without suffix."""
    file = f"characters/{slug(name)}"
    _save(folder / f"{file}.npz", target, reference_pose=target.reference_pose, height=target.height)
    bvh.write(folder / f"{file}.bvh", standing(target))
    return file


def _save(path: Path, body: Character, **data: Any) -> None:
    skeleton = body.skeleton
    common = {
        "joints": np.array(skeleton.names),
        "parents": skeleton.parents,
        "offsets": skeleton.offsets,
        "roles": np.array([role or "" for role in body.roles]),
        "structure": np.array(body.structure),
    }
    with atomic(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **common, **data)  # type: ignore[arg-type]


def standing(body: Character) -> Motion:
    """A frame of the reference pose on the floor."""
    root = np.array([[0.0, body.measures.hip_height, 0.0]])
    return body.motion(body.reference_pose[None], root, fps=30.0)
