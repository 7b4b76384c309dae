"""A small reader of Acclaim skeletons and motions, to compare with the same takes in BVH files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.skeleton import Skeleton

METRES = 0.0254 / 0.45


def read(asf: Path, amc: Path, step: int) -> tuple[Skeleton, np.ndarray, np.ndarray]:
    """Skeleton, local rotations ``(frames, joints, 4)`` and root ``(frames, 3)``, every ``step``-th frame.

    A joint stands at the start of its bone; its frame is the world's in the rest pose.
    """
    bones, names, parents = _skeleton(asf)
    frames = _frames(amc)[::step]
    offsets = np.zeros((len(names), 3))
    turned = rotation.identity(len(frames), len(names))
    root = np.array([frame["root"][:3] for frame in frames]) * METRES
    turned[:, 0] = _xyz(np.array([frame["root"][3:] for frame in frames]))
    for joint, name in enumerate(names[1:], 1):
        above = bones.get(names[parents[joint]])
        if above is not None:
            offsets[joint] = np.array(above["direction"]) * above["length"][0] * METRES
        axes = [("rx", "ry", "rz").index(axis) for axis in bones[name].get("dof", [])]
        if axes:
            angles = np.zeros((len(frames), 3))
            angles[:, axes] = [frame[name] for frame in frames]
            own = _xyz(np.array(bones[name]["axis"][:3], dtype=float))
            local = rotation.multiply(own[None], _xyz(angles))
            turned[:, joint] = rotation.multiply(local, rotation.conjugate(own)[None])
    return Skeleton(tuple(names), np.array(parents), offsets), turned, root


def _xyz(degrees: np.ndarray) -> np.ndarray:
    """About the fixed axes X, then Y, then Z."""
    return rotation.from_euler(np.radians(degrees[..., ::-1]), "ZYX")


def _skeleton(path: Path) -> tuple[dict[str, dict[str, list]], list[str], list[int]]:
    bones: dict[str, dict[str, list]] = {}
    names, parents, section, bone = ["root"], [-1], "", {}
    for line in path.read_text().splitlines():
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0].startswith(":"):
            section = words[0]
        elif section == ":bonedata":
            if words[0] == "begin":
                bone = {}
            elif words[0] == "end":
                bones[bone["name"][0]] = bone
            elif words[0] in ("direction", "length"):
                bone[words[0]] = [float(word) for word in words[1:]]
            else:
                bone[words[0]] = words[1:]
        elif section == ":hierarchy" and words[0] not in ("begin", "end"):
            for child in words[1:]:
                parents.append(names.index(words[0]))
                names.append(child)
    return bones, names, parents


def _frames(path: Path) -> list[dict[str, list[float]]]:
    frames: list[dict[str, list[float]]] = []
    for line in path.read_text().splitlines():
        words = line.split()
        if not words or words[0][0] in "#:":
            continue
        if len(words) == 1:
            frames.append({})
        else:
            frames[-1][words[0]] = [float(word) for word in words[1:]]
    return frames
