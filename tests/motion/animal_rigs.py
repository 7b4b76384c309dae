"""Animals as rigs name and build them, in metres, standing on y = 0 and facing +Z at rest; their motion."""

from __future__ import annotations

import numpy as np

from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import EndSite, Skeleton

Vector = tuple[float, float, float]
Bones = dict[str, tuple[str, Vector]]
"""Joint -> its parent and its place at rest, metres."""
X, Y = np.eye(3)[:2]


def horse(tail: str = "Bip01 Tail{}", above: str = "Bip01 Pelvis") -> Bones:
    """A horse of 1.6 m to the top of its head as 3ds Max's Biped writes it: thighs below a spine, the tail
    below the pelvis, hocks (HorseLink) between calf and foot."""
    bones: Bones = {
        "Bip01": ("", (0.0, 1.05, -0.5)),
        "Bip01 Pelvis": ("Bip01", (0.0, 1.05, -0.5)),
        "Bip01 Spine": ("Bip01 Pelvis", (0.0, 1.07, -0.45)),
        "Bip01 Spine1": ("Bip01 Spine", (0.0, 1.08, -0.1)),
        "Bip01 Spine2": ("Bip01 Spine1", (0.0, 1.1, 0.25)),
        "Bip01 Neck": ("Bip01 Spine2", (0.0, 1.15, 0.5)),
        "Bip01 Neck1": ("Bip01 Neck", (0.0, 1.35, 0.65)),
        "Bip01 Head": ("Bip01 Neck1", (0.0, 1.6, 0.8)),
        "Bip01 HeadNub": ("Bip01 Head", (0.0, 1.35, 1.15)),
    }
    for k, (y, z) in enumerate(((1.0, -0.7), (0.85, -0.8), (0.65, -0.85))):
        name = tail.format((k or "") if tail == "Bip01 Tail{}" else k + 1)
        bones[name] = (above, (0.0, y, z))
        above = name
    for letter, x in (("L", 0.15), ("R", -0.15)):
        side = f"Bip01 {letter}"
        bones |= {
            f"{side} Thigh": ("Bip01 Spine", (x, 0.95, -0.5)),
            f"{side} Calf": (f"{side} Thigh", (x, 0.75, -0.35)),
            f"{side} HorseLink": (f"{side} Calf", (x, 0.5, -0.6)),
            f"{side} Foot": (f"{side} HorseLink", (x, 0.15, -0.52)),
            f"{side} Toe0": (f"{side} Foot", (x, 0.0, -0.45)),
            f"{side} Clavicle": ("Bip01 Spine2", (x / 2, 1.1, 0.45)),
            f"{side} UpperArm": (f"{side} Clavicle", (x, 0.9, 0.5)),
            f"{side} Forearm": (f"{side} UpperArm", (x, 0.75, 0.4)),
            f"{side} Hand": (f"{side} Forearm", (x, 0.4, 0.42)),
            f"{side} Finger0": (f"{side} Hand", (x, 0.05, 0.46)),
        }
    return bones


def bird(wing: tuple[str, str, str] = ("UpperArm", "Forearm", "Hand"), slope: float = 25.0) -> Bones:
    """A hen of 0.45 m, its trunk sloping up towards the neck by so many degrees, its wings folded."""
    up, along = np.sin(np.radians(slope)), np.cos(np.radians(slope))

    def trunk(share: float, x: float = 0.0, above: float = 0.0) -> Vector:
        return x, float(0.22 + 0.2 * share * up + above), float(0.2 * share * along - 0.06)

    bones: Bones = {
        "Bip01": ("", trunk(0)),
        "Bip01 Pelvis": ("Bip01", trunk(0)),
        "Bip01 Spine": ("Bip01 Pelvis", trunk(0.2)),
        "Bip01 Spine1": ("Bip01 Spine", trunk(0.7)),
        "Bip01 Neck": ("Bip01 Spine1", trunk(1.0)),
        "Bip01 Neck1": ("Bip01 Neck", trunk(1.1, above=0.06)),
        "Bip01 Head": ("Bip01 Neck1", trunk(1.15, above=0.14)),
        "Bone_Beak": ("Bip01 Head", trunk(1.5, above=0.1)),
        "BN_Tail01": ("Bip01 Pelvis", trunk(-0.4, above=0.03)),
        "BN_Tail02": ("BN_Tail01", trunk(-0.8, above=0.1)),
    }
    for letter, x in (("L", 0.05), ("R", -0.05)):
        side = f"Bip01 {letter}"
        upper, middle, end = (f"{side} {part}" for part in wing)
        bones |= {
            f"{side} Thigh": ("Bip01 Pelvis", trunk(0, x)),
            f"{side} Calf": (f"{side} Thigh", (x, 0.15, 0.01)),
            f"{side} Foot": (f"{side} Calf", (x, 0.03, -0.03)),
            f"{side} Toe0": (f"{side} Foot", (x, 0.0, 0.04)),
            upper: ("Bip01 Spine1", trunk(0.8, 1.4 * x)),
            middle: (upper, trunk(0.35, 1.7 * x, -0.02)),
            end: (middle, trunk(-0.1, 1.5 * x, 0.02)),
        }
    return bones


def skeleton(bones: Bones, size: float = 1.0) -> Skeleton:
    """A skeleton whose joints have no rotation at rest; the last bones end in tips of a fifth of a hand."""
    names = sorted(bones, key=lambda name: _depth(bones, name))
    parents = [names.index(bones[name][0]) if bones[name][0] else -1 for name in names]
    places = size * np.array([bones[name][1] for name in names])
    offsets = np.array([p - places[k] if k >= 0 else p for p, k in zip(places, parents, strict=True)])
    last = [joint for joint in range(len(names)) if joint not in parents]
    tips = tuple(EndSite(joint, tuple((0.1 * offsets[joint]).tolist())) for joint in last)
    return Skeleton(tuple(names), np.array(parents), offsets, tips)


def _depth(bones: Bones, name: str) -> int:
    parent = bones[name][0]
    return _depth(bones, parent) + 1 if parent else 0


def written(path, bones: Bones, *, scale: float, size: float = 1.0, facing=0.0, pitch=None, fps=30.0):
    """Write an animal that steps on the spot. facing: degrees. pitch: degrees ``(frames,)`` by which the
    trunk tips down, the feet following the hips; scale: units of the file in a metre."""
    body = skeleton(bones, size)
    pitch = 3.0 * np.sin(np.arange(60) / 5) if pitch is None else np.asarray(pitch)
    turned = rotation.identity(len(pitch), len(body))
    turned[:, 0] = rotation.multiply(
        rotation.about(Y, np.radians(facing))[None], rotation.about(X, np.radians(pitch))
    )
    for name, sign in (("Bip01 L Thigh", 1.0), ("Bip01 R Thigh", -1.0)):
        step = rotation.about(X, np.radians(10.0) * sign * np.sin(np.arange(len(pitch)) / 4))
        level = rotation.about(X, np.radians(-pitch))
        turned[:, body.index(name)] = rotation.multiply(level, step)
    root = np.tile(body.offsets[0], (len(pitch), 1))
    bvh.write(path, Character.of(path.stem, body).motion(turned, root, fps), scale=scale)
    return path
