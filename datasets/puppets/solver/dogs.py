"""One performance by one dog, in closed form and over all frames at once.

Paws follow their plants. The line from the hip joints to the shoulder joints goes where the score wants it,
no higher than the paws allow; the back bends evenly about that line. Blades swing with the fore legs, and
all four legs are two bones each whose planes follow rump and chest: stifles bend forward, elbows back.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..bodies.dogs import TAIL_DOWN
from ..bodies.structures import Body
from ..conventions import SIDES, sign
from ..curves import lower_envelope
from ..matrices import about, align, cross, dot, from_vector, part_way, unit
from ..performances.score import LIMBS, DogScore
from .limbs import Limb, bend
from .paws import THICK, Grounds, PawPath, across, along, grounds, paw_paths, sizes_of
from .pose import Pose, Solution

_PASSES = 4
_LEFT = np.array([1.0, 0.0, 0.0])
_DOWN = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True)
class DogManner:
    """How a dog does what the score leaves open. Another manner is another right answer.

    knees, elbows: turned outward, radians. front: share of the back's bend moved from its hind to its fore
    half. blades: share of a fore leg's swing that the blade makes.
    """

    knees: float = 0.05
    elbows: float = 0.05
    front: float = 0.0
    blades: float = 0.55


USUAL, SECOND = DogManner(), DogManner(knees=0.20, elbows=0.18, front=0.25, blades=0.38)


def solve(score: DogScore, body: Body, manner: DogManner = USUAL) -> Solution:
    """The performance of ``score`` by ``body``; its contacts are those of ``dogs.PAWS``."""
    ground = grounds(score, body)
    paths = paw_paths(score, body, ground)
    lowered = np.zeros((score.frames, 2))
    for _ in range(_PASSES):
        pose = _posed(score, body, manner, ground, paths, lowered)
        lowered = lowered + _too_high(pose, body, paths)
    pose = _posed(score, body, manner, ground, paths, lowered)
    planted, pivoting = (
        np.stack([getattr(paths[limb], label) for limb in LIMBS], axis=-1)
        for label in ("planted", "pivoting")
    )
    return pose.solution(planted, pivoting)


def _posed(
    score: DogScore,
    body: Body,
    manner: DogManner,
    ground: Grounds,
    paths: dict[str, PawPath],
    lowered: np.ndarray,
) -> Pose:
    pose = Pose(body, score.frames)
    _set_trunk(pose, score, manner, ground, lowered)
    _set_head(pose, score, ground)
    _set_tail(pose, score, ground)
    for limb in LIMBS:
        _set_limb(pose, limb, score, manner, paths[limb])
    return pose


# ---------------------------------------------------------------------------------------- the trunk
def _set_trunk(
    pose: Pose, score: DogScore, manner: DogManner, ground: Grounds, lowered: np.ndarray
) -> None:
    body, sizes = pose.body, sizes_of(pose.body)
    rear = _over(ground.hind, ground.hind_height - lowered[:, 0], score, sizes.leg)
    fore = _over(ground.fore, ground.fore_height - lowered[:, 1], score, sizes.leg)
    line = unit(fore - rear)
    drawn = _middle(body, "arm") - _middle(body, "up_leg")
    slope = np.arcsin(line[:, 1]) - float(np.arctan2(drawn[1], drawn[2]))
    base = about(1, np.arctan2(line[:, 0], line[:, 2])) @ about(0, -slope)
    turn, arch, roll = score.trunk.chest.T
    bent = np.stack([arch, turn, -roll], axis=-1)
    base = base @ from_vector(-0.5 * bent)
    hips = base @ from_vector(score.trunk.pelvis[:, [1, 0, 2]] * [1.0, 1.0, -1.0])
    shares = (0.5 - 0.5 * manner.front, 0.5 + 0.5 * manner.front)
    loin = base @ from_vector(shares[0] * bent)
    chest = loin @ from_vector(shares[1] * bent)
    for part, orientation in (("hips", hips), ("spine_1", loin), ("spine_2", chest)):
        pose.set(part, orientation)
    made = _between(pose)
    back = _shortest(unit(made), line)
    place = rear + score.anchor[:, None] * (fore - (back @ made[..., None])[..., 0] - rear)
    pose.positions[0] = place - back @ hips @ _middle(body, "up_leg")
    for part, orientation in (("hips", hips), ("spine_1", loin), ("spine_2", chest)):
        pose.set(part, back @ orientation)
    for side in SIDES:
        pose.set(f"{side}_shoulder", pose.of("spine_2"))


def _over(floor: np.ndarray, height: np.ndarray, score: DogScore, leg: float) -> np.ndarray:
    """``(frames, 3)`` where one end of the trunk should be."""
    left, ahead = score.sway[:, :1], score.sway[:, 1:]
    flat = floor + leg * (left * across(score.heading) + ahead * along(score.heading))
    return np.stack([flat[:, 0], height, flat[:, 1]], axis=-1)


def _middle(body: Body, part: str) -> np.ndarray:
    """Between a pair of joints, from the root, standing."""
    return 0.5 * (body.reach(f"left_{part}", "hips") + body.reach(f"right_{part}", "hips"))


def _between(pose: Pose) -> np.ndarray:
    """The line from the middle of the hip joints to that of the shoulder joints, blades at rest on the
    chest."""
    body = pose.body
    from_chest = 0.5 * (body.reach("left_arm", "spine_2") + body.reach("right_arm", "spine_2"))
    rear = pose.of("hips") @ _middle(body, "up_leg")
    return pose.at("spine_2") + pose.of("spine_2") @ from_chest - rear


def _shortest(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Matrices turning unit vectors ``(frames, 3)`` the shortest way onto others."""
    axis = cross(start, end)
    x, y, z = axis[:, 0], axis[:, 1], axis[:, 2]
    zero = np.zeros_like(x)
    skew = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)
    return np.eye(3) + skew + skew @ skew / (1.0 + dot(start, end))[..., None]


def _set_head(pose: Pose, score: DogScore, ground: Grounds) -> None:
    turn, down, left = score.trunk.gaze.T
    ahead = ground.fore_heading
    neck = about(1, ahead + 0.45 * turn) @ about(0, score.neck + 0.2 * down)
    pose.set("neck", part_way(pose.of("spine_2"), neck, np.full(score.frames, 0.8)))
    pose.set("head", about(1, ahead + turn) @ about(0, down) @ about(2, -left))


def _set_tail(pose: Pose, score: DogScore, ground: Grounds) -> None:
    """The tail hangs from the rump but keeps off the floor."""
    length, thick = 0.5 * sizes_of(pose.body).tail, THICK * sizes_of(pose.body).leg
    behind = ground.hind_heading
    for part, (raised, aside) in (("tail_1", (0, 1)), ("tail_2", (2, 3))):
        room = (pose.at(part)[:, 1] - 0.5 * thick) / length
        lowest = np.arcsin(0.95 * np.tanh(np.maximum(room, 0.0) / 0.95))
        down = TAIL_DOWN - score.tail[:, raised]
        # not lower than the floor allows, with a round corner
        down = 0.5 * (down + lowest - np.sqrt((down - lowest) ** 2 + 0.02))
        pose.set(part, about(1, behind + score.tail[:, aside]) @ about(0, TAIL_DOWN - down))


# ----------------------------------------------------------------------------------------- the legs
_PARTS = {"hind": ("up_leg", "leg", "foot"), "fore": ("arm", "forearm", "hand")}


@cache
def limb_of(body: Body, limb: str) -> Limb:
    """The two bones of a leg as if drawn straight down; elbows point back, stifles forward."""
    side, end = limb.split("_")
    _, middle, last = _PARTS[end]
    upper, lower = body.offset(f"{side}_{middle}"), body.offset(f"{side}_{last}")
    hinge = _LEFT if end == "hind" else -_LEFT
    return Limb(
        bone=_DOWN,
        hinge=hinge,
        upper=float(np.sqrt(upper @ upper)),
        lower=float(np.sqrt(lower @ lower)),
        ease=_DOWN,
        natural=hinge,
        tightest=np.radians(24.0),
        exact=0.97,
    )


@cache
def _straightening(body: Body, part: str, limb: str) -> np.ndarray:
    """``(3, 3)`` turning the bone that ends in a part of a limb, as it is drawn, to straight down."""
    drawn, hinge = unit(body.offset(part)), limb_of(body, limb).hinge
    across = unit(hinge - drawn * float(drawn @ hinge))
    return np.asarray(align(drawn, across, _DOWN[None], hinge[None])[0])


def _set_limb(pose: Pose, limb: str, score: DogScore, manner: DogManner, paw: PawPath) -> None:
    side, end = limb.split("_")
    top, middle, last = (f"{side}_{part}" for part in _PARTS[end])
    body, goal, hind = pose.body, paw.joint, end == "hind"
    if not hind:
        goal = _held_up(pose, limb, score, goal)
        _swing_blade(pose, side, manner, goal)
    base = pose.of("hips" if hind else "spine_2")
    outward = (manner.knees if hind else manner.elbows) + score.spread[:, 0 if hind else 1]
    drawn = limb_of(body, limb)
    swivel = sign(side) * outward * (1.0 if hind else -1.0)
    upper, lower = bend(drawn, pose.at(top), goal, base, swivel)
    lower = lower @ _straightening(body, last, limb)
    pose.set(top, upper @ _straightening(body, middle, limb))
    pose.set(middle, lower)
    pose.set(last, _paw(limb, score, paw, lower))


def _held_up(pose: Pose, limb: str, score: DogScore, goal: np.ndarray) -> np.ndarray:
    air = score.paws[limb].air
    if air is None:
        return goal
    side = limb.split("_")[0]
    c, s = np.cos(score.heading), np.sin(score.heading)
    out, up, ahead = (air.reach * sizes_of(pose.body).fore_leg * [sign(side), 1.0, 1.0]).T
    held = pose.at(f"{side}_arm") + np.stack([out * c + ahead * s, up, ahead * c - out * s], axis=-1)
    return goal + air.weight[:, None] * (held - goal)


def _paw(limb: str, score: DogScore, paw: PawPath, forearm: np.ndarray) -> np.ndarray:
    air = score.paws[limb].air
    if air is None:
        return paw.orientation
    return part_way(paw.orientation, forearm @ about(0, np.full(score.frames, 0.5)), air.weight)


def _swing_blade(pose: Pose, side: str, manner: DogManner, goal: np.ndarray) -> None:
    """The blade turns about its top as the leg below it swings."""
    chest = pose.of("spine_2")
    top = pose.at(f"{side}_shoulder")
    below = np.swapaxes(chest, -1, -2) @ (goal - top)[..., None]
    body = pose.body
    drawn = body.reach(f"{side}_hand", f"{side}_shoulder")
    swung = np.arctan2(below[:, 2, 0], -below[:, 1, 0]) - float(np.arctan2(drawn[2], -drawn[1]))
    swung = 0.7 * np.tanh(manner.blades * swung / 0.7)
    pose.set(f"{side}_shoulder", chest @ about(0, -swung))


def _too_high(pose: Pose, body: Body, paths: dict[str, PawPath]) -> np.ndarray:
    """``(frames, 2)`` metres by which rump and shoulders are too high for the paws to stay down."""
    found = []
    for end in ("hind", "fore"):
        over = np.zeros(pose.positions.shape[1])
        for side in SIDES:
            limb = limb_of(body, f"{side}_{end}")
            apart = pose.at(f"{side}_{_PARTS[end][0]}") - paths[f"{side}_{end}"].joint
            flat = (apart[:, [0, 2]] ** 2).sum(axis=-1)
            length = 0.955 * limb.longest
            rise = np.sqrt(np.maximum(length * length - flat, 0.04 * length * length))
            over = np.maximum(over, np.where(paths[f"{side}_{end}"].down, apart[:, 1] - rise, 0.0))
        found.append(-lower_envelope(-over, 4))
    return np.stack(found, axis=-1)
