"""Joint sets, named after the rigs they stand for, and bodies built on them.

- ``body22``: the 22-joint body of motion-capture data sets.
- ``body28``: the 28-joint structure of the skeleton-aware retargeting papers: toe ends and head top are
  joints, and each collar bone and one spine bone are split by a joint that never rotates on its own.
- ``body23``: the other structure of these papers: a pelvis between the hips and the legs.
- ``h36m17``: the 17 points of pose estimation: no collar bones, no hands, no feet beyond the ankle.

All are drawn over one body: ``positions`` says where each part lies, a structure says which parts it has.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from retarget_bench.motion.contact import CONTACT_ROLES
from retarget_bench.motion.roles import is_role

from ..conventions import SIDES, sign
from .proportions import Proportions

Places = Mapping[str, np.ndarray | tuple[float, float, float]]
Row = tuple[str, str, str]
"""Joint name, part, parent's part."""


@dataclass(frozen=True, eq=False)
class Structure:
    """rows:    the joints of the rig, the root first.
    bending: the parts of the spine that bend, with their share of the whole bend.
    levels:  all parts of the spine, with their height over the root, shares of the trunk; the last is the
             chest.
    hidden:  further rows: leaves that are no joints of the rig and that the solver alone knows of.
    rigid:   parts that never turn on their own, beside those that split or end a bone.
    role_names: roles of parts whose role is not the part's own name.
    contact_roles: what contacts are labelled on, as far as the rig has it.
    """

    name: str
    rows: Sequence[Row]
    bending: Mapping[str, float]
    levels: Mapping[str, float]
    hidden: Sequence[Row] = ()
    rigid: tuple[str, ...] = ()
    role_names: Mapping[str, str] = field(default_factory=dict)
    contact_roles: tuple[str, ...] = CONTACT_ROLES

    @property
    def joints(self) -> int:
        """Number of joints of the rig: the first of the parts."""
        return len(self.rows)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the joints of the rig."""
        return tuple(name for name, _, _ in self.rows)

    @cached_property
    def parts(self) -> tuple[str, ...]:
        return tuple(part for _, part, _ in (*self.rows, *self.hidden))

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """Index of each part's parent; -1 of the root."""
        parents = (parent for _, _, parent in (*self.rows, *self.hidden))
        return tuple(self.parts.index(parent) if parent else -1 for parent in parents)

    @cached_property
    def silent(self) -> tuple[str, ...]:
        """Parts that never turn on their own."""
        return (*(part for part in self.parts if part.endswith(("_split", "_end", "_top"))), *self.rigid)

    @cached_property
    def roles(self) -> tuple[str | None, ...]:
        """The role of each joint of the rig, or None."""
        names = (self.role_names.get(part, part) for _, part, _ in self.rows)
        return tuple(role if is_role(role) else None for role in names)

    @property
    def chest(self) -> str:
        return [*self.levels][-1]

    @property
    def collars(self) -> bool:
        """True if collar bones move."""
        return "left_shoulder" not in self.silent

    @property
    def contacts(self) -> tuple[int, ...]:
        """Indices of ``contact_roles`` that are joints of the rig."""
        return tuple(k for k, role in enumerate(self.contact_roles) if role in self.roles)

    @property
    def labelled(self) -> tuple[str, ...]:
        """The roles of the joints whose contacts are labelled."""
        return tuple(self.contact_roles[column] for column in self.contacts)

    @property
    def lever(self) -> float:
        """Way of the base of the neck forward when the spine bends, shares of the trunk a radian."""
        return sum(share * (1.0 - self.levels[part]) for part, share in self.bending.items())

    def positions(self, sizes: Proportions) -> dict[str, np.ndarray]:
        """Part -> ``(3,)`` metres, standing on the floor; people in the T-pose."""
        places = both_sides(*self.layout(sizes))
        return {part: places[part] for part in self.parts}

    def tips(self, sizes: Proportions) -> dict[str, np.ndarray]:
        """Ends of the last bones, from their joint; parts that are ends themselves have none."""
        parents = {self.parts[parent] for parent in self.parents[: self.joints] if parent >= 0}
        last = {part for part in self.parts[: self.joints] if part not in parents}
        return {part: end for part, end in both_sides(*self.ends(sizes)).items() if part in last}

    def layout(self, sizes: Proportions) -> tuple[Places, Places]:
        """Places of the parts of trunk and head, and of those of the left side."""
        return _trunk(sizes, self.levels), {**_leg(sizes), **_arm(sizes)}

    def ends(self, sizes: Proportions) -> tuple[Places, Places]:
        """Likewise where bones end."""
        sides = {
            "hand": (sizes.hand, 0.0, 0.0),
            "toe": (0.0, 0.0, sizes.toes),
            "foot": (0.0, -sizes.ankle, 0.0),
        }
        return {"head": (0.0, sizes.head, 0.0)}, sides


def both_sides(middle: Places, left: Places) -> dict[str, np.ndarray]:
    """Parts in the middle, and those on the left for either side."""
    both = {part: np.array(place) for part, place in middle.items()}
    for side in SIDES:
        out = np.array([sign(side), 1.0, 1.0])
        both |= {f"{side}_{part}": out * np.array(place) + 0.0 for part, place in left.items()}
    return both


# ---------------------------------------------------------------------------------------- the body
_CURVE = ((0.0, 0.14, 0.38, 0.64, 1.0), (0.0, 0.0, 0.03, 0.01, -0.04))
"""Heights over the root and how far forward the spine lies there, shares of the trunk: the small of the
back lies forward, the upper back behind."""
_HUNCH = (0.0, 0.0, -0.15, -0.30, 0.70)
"""Likewise what a hunched back adds, shares of ``hunch``."""


def _spine(sizes: Proportions, height: float) -> np.ndarray:
    """A point of the spine at a height over the root, shares of the trunk."""
    ahead = float(np.interp(height, *_CURVE)) * sizes.trunk
    ahead += float(np.interp(height, _CURVE[0], _HUNCH)) * sizes.hunch
    return np.array([0.0, sizes.leg + sizes.pelvis + height * sizes.trunk, ahead])


def _trunk(sizes: Proportions, levels: Mapping[str, float]) -> Places:
    neck = _spine(sizes, 1.0)
    head = neck + np.array([0.0, sizes.neck, 0.25 * sizes.neck + 0.3 * sizes.hunch])
    return {
        "hips": _spine(sizes, 0.0),
        "pelvis": (0.0, sizes.leg + 0.3 * sizes.pelvis, 0.0),
        **{part: _spine(sizes, height) for part, height in levels.items()},
        "neck": neck,
        "head": head,
        "head_top": head + np.array([0.0, sizes.head, 0.0]),
    }


def _leg(sizes: Proportions) -> Places:
    out = sizes.hip_half
    return {
        "up_leg": (out, sizes.leg, 0.0),
        "leg": (out, sizes.ankle + sizes.shank, 0.0),
        "foot": (out, sizes.ankle, 0.0),
        "toe": (out, sizes.ball_height, sizes.ball),
        "toe_end": (out, sizes.ball_height, sizes.ball + sizes.toes),
    }


def _arm(sizes: Proportions) -> Places:
    up = sizes.leg + sizes.pelvis + sizes.trunk - sizes.shoulder_drop
    ahead = float(_spine(sizes, 0.64)[2]) + 0.4 * sizes.hunch
    out = sizes.shoulder_half
    return {
        "shoulder": (sizes.clavicle, up, ahead),
        "shoulder_split": (0.5 * (sizes.clavicle + out), up, ahead),
        "arm": (out, up, ahead),
        "forearm": (out + sizes.upper_arm, up, ahead),
        "hand": (out + sizes.upper_arm + sizes.forearm, up, ahead),
    }


# ------------------------------------------------------------------------------------ the structures
def paired(rows: list[Row], sides: tuple[str, ...] = SIDES) -> list[Row]:
    """The rows for one side, then for the other; ``*`` stands for the side, ``?`` for its first letter."""
    return [
        (
            joint.replace("*", side.capitalize()).replace("?", side[0]),
            f"{side}_{part}",
            parent if parent.startswith(("hips", "pelvis", "spine")) else f"{side}_{parent}",
        )
        for side in sides
        for joint, part, parent in rows
    ]


def _legs(toe: str, root: str = "hips", end: str = "") -> list[Row]:
    rows = [
        ("*UpLeg", "up_leg", root),
        ("*Leg", "leg", "up_leg"),
        ("*Foot", "foot", "leg"),
        (toe, "toe", "foot"),
    ]
    return paired([*rows, (end, "toe_end", "toe")] if end else rows)


ARMS = [
    ("*Shoulder", "shoulder", "spine_3"),
    ("*Arm", "arm", "shoulder"),
    ("*ForeArm", "forearm", "arm"),
    ("*Hand", "hand", "forearm"),
]
_SPINE = [("Spine", "spine_1", "hips"), ("Spine1", "spine_2", "spine_1"), ("Spine2", "spine_3", "spine_2")]
_HEAD = [("Neck", "neck", "spine_3"), ("Head", "head", "neck")]

_BENDING = {"spine_1": 0.30, "spine_2": 0.35, "spine_3": 0.35}
_LEVELS = {"spine_1": 0.14, "spine_2": 0.38, "spine_3": 0.64}

BODY22 = Structure(
    "body22", [("Hips", "hips", ""), *_legs("*Toe"), *_SPINE, *_HEAD, *paired(ARMS)], _BENDING, _LEVELS
)

BODY28 = Structure(
    "body28",
    [
        ("Hips", "hips", ""),
        *_legs("*ToeBase", end="*Toe_End"),
        *_SPINE[:2],
        ("Spine1_split", "spine_2_split", "spine_2"),
        ("Spine2", "spine_3", "spine_2_split"),
        *_HEAD,
        ("HeadTop_End", "head_top", "head"),
        *paired(
            [
                ARMS[0],
                ("*Shoulder_split", "shoulder_split", "shoulder"),
                ("*Arm", "arm", "shoulder_split"),
                *ARMS[2:],
            ]
        ),
    ],
    _BENDING,
    {"spine_1": 0.14, "spine_2": 0.30, "spine_2_split": 0.46, "spine_3": 0.62},
)

BODY23 = Structure(
    "body23",
    [
        ("Hips", "hips", ""),
        ("Pelvis", "pelvis", "hips"),
        *_legs("*ToeBase", root="pelvis"),
        *_SPINE,
        *_HEAD,
        *paired(ARMS),
    ],
    _BENDING,
    _LEVELS,
    rigid=("pelvis",),
)

H36M17 = Structure(
    "h36m17",
    [
        ("pelvis", "hips", ""),
        *paired(
            [("?_hip", "up_leg", "hips"), ("?_knee", "leg", "up_leg"), ("?_ankle", "foot", "leg")],
            SIDES[::-1],
        ),
        ("spine", "spine_1", "hips"),
        ("thorax", "spine_3", "spine_1"),
        # the joint called neck lies at the base of the skull, the one called head at the crown
        ("neck", "head", "spine_3"),
        ("head", "head_top", "head"),
        *paired(
            [
                ("?_shoulder", "arm", "spine_3"),
                ("?_elbow", "forearm", "arm"),
                ("?_wrist", "hand", "forearm"),
            ]
        ),
    ],
    bending={"spine_1": 0.90, "spine_3": 0.10},
    levels={"spine_1": 0.40, "spine_3": 1.0},
    hidden=[("", "neck", "spine_3"), *paired([("", "shoulder", "spine_3"), ("", "toe", "foot")])],
    rigid=("left_shoulder", "right_shoulder"),
    role_names={"spine_3": "spine_2", "head": "neck", "head_top": "head"},
)

STRUCTURES = {each.name: each for each in (BODY22, BODY28, BODY23, H36M17)}


@dataclass(frozen=True, eq=False)
class Body:
    """A performer, in the T-pose: Y up, facing +Z, left arm along +X, soles on the floor.

    offsets: ``(parts, 3)`` metres, from parent to joint, along world axes; row 0 is the root's place.
    part:    name of a part (``left_forearm``) -> joint. Parts are this package's own words; joint names
             are the structure's. The rig has the first ``structure.joints`` of them.
    rest:    how the rest pose is drawn (``rigs.py``).
    held_out: never in a training set.
    """

    name: str
    structure: Structure
    proportions: Proportions
    rest: str
    held_out: bool = False

    @cached_property
    def part(self) -> Mapping[str, int]:
        return {part: joint for joint, part in enumerate(self.structure.parts)}

    @cached_property
    def children(self) -> Mapping[str, list[tuple[int, str, bool]]]:
        """Part -> joint and part of each of its children, and whether that is silent."""
        structure = self.structure
        children: dict[str, list[tuple[int, str, bool]]] = {part: [] for part in structure.parts}
        for child, (part, parent) in enumerate(zip(structure.parts, structure.parents, strict=True)):
            if parent >= 0:
                children[structure.parts[parent]].append((child, part, part in structure.silent))
        return children

    @cached_property
    def places(self) -> Mapping[str, np.ndarray]:
        """Part -> ``(3,)`` metres, its joint in the T-pose."""
        return self.structure.positions(self.proportions)

    @cached_property
    def offsets(self) -> np.ndarray:
        places = np.stack(list(self.places.values()))
        up = np.array(self.structure.parents)
        return places - np.where(up[:, None] >= 0, places[up], 0.0)

    @cached_property
    def tips(self) -> Mapping[str, np.ndarray]:
        """Part -> where its last bone ends, from its joint, for joints without children."""
        return self.structure.tips(self.proportions)

    def reach(self, part: str, ancestor: str) -> np.ndarray:
        """``(3,)`` from one part's joint to another's in the T-pose."""
        return self.places[part] - self.places[ancestor]

    def positions(self, orientations: np.ndarray, root: np.ndarray) -> np.ndarray:
        """Positions ``(frames, parts, 3)`` from world orientations ``(frames, parts, 3, 3)`` against the
        T-pose and the root's positions ``(frames, 3)``."""
        positions = np.empty((*orientations.shape[:2], 3))
        positions[:, 0] = root
        for joint, parent in enumerate(self.structure.parents):
            if parent >= 0:
                positions[:, joint] = positions[:, parent] + orientations[:, parent] @ self.offsets[joint]
        return positions
