"""Points every bone where the source's points; needs joint positions only, and counts no joints."""

import numpy as np

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.motion import hinges, root_rules, rotation, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.fitting.bones import unit, wahba
from retarget_bench.motion.roles import chain

_FROM_PARENT = 1e-4
"""Weight of the parent's orientation where several bones leave a joint: it decides if they are in line."""
_LONG = ("arm", "forearm", "up_leg", "leg")
"""Bones that rest alike on all bodies in the reference pose. Others rest as their rig pleases."""


class BoneDirections(Method):
    """Global bone directions matched, bone lengths the target's own.

    Every bone is swung from the reference pose, the shortest way: the long bones of arms and legs until
    they point where the source's do, spine, neck, collar bones, feet and fingers, which rigs lay out
    differently at rest, as far as the source's have turned from theirs. The twist comes from the source's
    rotations where it has some, else from the parent and, for thighs and upper arms, from the plane in
    which knee and elbow bend. Hips, chest and hands, which carry several bones at fixed angles, take the
    source's orientation; positions alone give it by a least-squares fit (Wahba's problem). A spine of
    another count is resampled along its length.
    """

    def __init__(self, root_rule: root_rules.ScalingRule = "hip_height") -> None:
        self.root_rule = root_rules.check(root_rule, root_rules.SCALING_RULES)
        self.card = MethodCard(
            name="bone_directions",
            summary="Every bone points where the source's does, root path scaled by one ratio",
            version="1",
            accepts=("motion", "positions"),
            parameters={
                "root_rule": "length whose ratio scales the root path: "
                + ", ".join(root_rules.SCALING_RULES)
            },
        )

    def supports(self, source: Character, target: Character) -> str | None:
        return transfer.reason(source, target) or root_rules.reason(self.root_rule, source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        turned = _Pointing(source, target).orientations()
        local = transfer.from_relative(target, turned)
        return target.motion(
            local, transfer.scaled_root(source, target, local, self.root_rule, None), source.fps
        )


class _Pointing:
    """One retargeting in progress: where the source has what the target's joints stand for."""

    def __init__(self, source: Prediction, target: Character) -> None:
        self.target = target
        self.rest = target.reference_places
        self.places, self.present = counterparts(source.positions, source.character, target)
        at_rest, _ = counterparts(source.character.reference_places[None], source.character, target)
        self.rest_places = at_rest[0]
        self.copied: np.ndarray | None = None
        if isinstance(source, Motion):
            self.copied = transfer.orientations(source, target)
            self.twin = transfer.correspondence(source.character, target)

    def orientations(self) -> np.ndarray:
        """``(frames, joints, 4)`` relative to the reference pose, parents before children."""
        tree = self.target.skeleton.parents.tolist()
        out = np.empty((len(self.places), len(tree), 4))
        for joint, parent in enumerate(tree):
            above = out[:, parent] if parent >= 0 else np.broadcast_to(rotation.identity(), out[:, 0].shape)
            copied = self.copied is not None and self.twin[joint] >= 0
            start = self.copied[:, joint] if self.copied is not None and copied else above
            bones = self._bones(joint)
            if len(bones) == 1:
                out[:, joint] = self._pointed(joint, bones[0], start)
            elif bones and self.copied is None:
                out[:, joint] = self._fitted(joint, bones, above)
            else:
                out[:, joint] = start
        return out

    def _bones(self, joint: int) -> list[int]:
        """The next joints below this one that the source knows, past those without a meaning."""
        if not self.present[joint]:
            return []
        ends, todo = [], list(self.target.skeleton.children[joint])
        while todo:
            below = todo.pop(0)
            if self.present[below]:
                ends.append(below)
            elif self.target.roles[below] is None:
                todo += self.target.skeleton.children[below]
        return ends

    def _pointed(self, joint: int, end: int, start: np.ndarray) -> np.ndarray:
        """``(frames, 4)``: ``start`` swung until the bone to ``end`` points where the source's does."""
        bone, role = self.places[:, end] - self.places[:, joint], self.target.roles[joint] or ""
        rest = self.rest if role.endswith(_LONG) else self.rest_places
        swing = rotation.between(rotation.rotate(start, rest[end] - rest[joint]), bone)
        turned = rotation.multiply(swing, start)
        hinge = self.target.hinge(role)
        after = self._bones(end)
        if self.copied is not None or hinge is None or len(after) != 1:
            return turned
        normal, share = hinges.bend(bone, self.places[:, after[0]] - self.places[:, end])
        axis, along = rotation.rotate(turned, hinge), unit(bone)
        axis = axis - along * (axis * along).sum(-1, keepdims=True)
        angle = np.arctan2((np.cross(axis, normal) * along).sum(-1), (axis * normal).sum(-1))
        return rotation.multiply(rotation.about(along, share * angle), turned)

    def _fitted(self, joint: int, ends: list[int], above: np.ndarray) -> np.ndarray:
        """``(frames, 4)`` best turn of the source's bones from its reference pose."""
        now = unit(self.places[:, ends] - self.places[:, joint, None])
        then = unit(self.rest_places[ends] - self.rest_places[joint])
        return wahba(now, then, above, _FROM_PARENT)


def counterparts(places: np.ndarray, source: Character, target: Character) -> tuple[np.ndarray, np.ndarray]:
    """``(frames, target joints, 3)`` where the source has what they stand for, and which of them it has.

    places: ``(frames, source joints, 3)``. By role; spines, necks and tails of other counts are resampled
    along their length.
    """
    out = np.zeros((len(places), len(target.skeleton), 3))
    present = np.zeros(len(target.skeleton), dtype=bool)
    for role, joint in target.joint_of.items():
        if role in source.joint_of:
            out[:, joint], present[joint] = places[:, source.joint_of[role]], True
    for source_line, target_line in zip(_lines(source), _lines(target), strict=True):
        if len(source_line) < 2 or len(target_line) < 2 or len(source_line) == len(target_line):
            continue
        at, marks = _shares(source, source_line), _shares(target, target_line)
        for share, joint in zip(marks[1:-1], target_line[1:-1], strict=True):
            low = min(int(np.searchsorted(at, share, side="right")) - 1, len(at) - 2)
            part = (share - at[low]) / max(at[low + 1] - at[low], 1e-12)
            first, second = places[:, source_line[low]], places[:, source_line[low + 1]]
            out[:, joint], present[joint] = first + part * (second - first), True
    return out, present


def _lines(body: Character) -> list[list[int]]:
    """Chains whose joint counts differ between bodies, with their fixed ends: spine, neck, tail."""
    spine, neck, tail = (chain(body.roles, stem) for stem in ("spine", "neck", "tail"))
    ends = [body.joint_of[role] for role in ("hips", "head") if role in body.joint_of]
    return [[*ends[:1], *spine, *(neck[:1] or ends[1:])], [*neck, *ends[1:]], tail]


def _shares(body: Character, joints: list[int]) -> np.ndarray:
    """``(joints,)`` how far along the line each joint lies, from 0 to 1, in the reference pose."""
    places = body.reference_places[joints]
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return along / max(along[-1], 1e-12)


plugin = BoneDirections
