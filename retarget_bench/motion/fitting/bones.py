"""Orientations whose bones end where joints were seen: a closed form, then Gauss-Newton steps.

``Tree`` is a body laid out for this, with the evidence in its bones for the rotations of its joints.

Orientations are relative to the reference pose and in the world, ``(frames, joints, 4)``. Seen so, a bone
depends on the joint that it leaves and on no other, and a step of Gauss-Newton over a whole body is a
recursion over its tree with matrices of 3 x 3: what is left to gain below a joint is a quadratic function
of where that joint is. The cost grows with the number of joints, not with its cube. Frames are independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.hinges import FOLDED
from retarget_bench.motion.skeleton import frozen

NOTHING = 1e-5
"""Metres: a bone shorter than this tells no direction; bones this near to one line tell no twist."""
_FOLDED = 0.3
"""Sine of the angle of two bones in the reference pose from where on their plane shows a hinge."""
_BORROWED = 1e-2
"""Weight of a bone that leaves a zero-length child of a joint, beside its own bones."""
_ABOVE = 1e-8
"""Weight of the parent's orientation beside the bones: it decides what they leave open."""
_PULL = 1e-8
"""Weight of the first orientation beside a joint's longest bone: it decides what positions leave open."""
_STEPS, _GAIN = 14, 5e-4
"""Steps at most, and the share of the cost that the last one gains."""
_WARY, _LEAST = 10.0, 1e-6
"""Damping at the start, for each square metre of cost as a share of all squared bone lengths; at least."""
_EASE, _CARE, _STUCK = 0.2, 10.0, 1e4
"""Factors of the damping after a step that gains, and after one that does not; where it ends a frame."""
_NEAR = 1e-16
"""Share of the sum of all squared bone lengths that is as good as no cost."""
_AT_ONCE = 100_000
"""Frames times joints that are worked on together, to bound memory."""
_LONGER = 3.0
"""Factor of bone lengths beyond which positions are not thought to be of this body at all."""


@dataclass(frozen=True, eq=False)
class Sight:
    """The evidence for one joint's rotation.

    own:      children at the ends of bones that leave this joint and have a length.
    borrowed: the same of zero-length children and theirs, which stand in the same place: likely, but not
              surely, they turn with this joint.
    axis:     ``(3,)`` the direction in which the own bones lie most, in the reference pose; 0 without any.
    spread:   metres that the ends of the own bones lie off that line: how well the twist about it is seen.
    lent:     share of their length that the ends of all bones, borrowed ones too, lie off one line.
    hinge:    ``(3,)`` the axis, in the reference pose, about which ``bend[1]`` swings round ``bend[0]``:
              the two bones after this joint, by their ends. None where no hinge is known.
    """

    own: tuple[int, ...]
    borrowed: tuple[int, ...]
    axis: np.ndarray
    spread: float
    lent: float
    hinge: np.ndarray | None = None
    bend: tuple[int, int] = (-1, -1)


@dataclass(frozen=True, eq=False)
class Tree:
    """A body laid out for fitting.

    bones: ``(joints, 3)`` metres in the reference pose, from parent to joint; 0 for the root.
    sights: one per joint.
    """

    character: Character
    parents: tuple[int, ...]
    children: tuple[tuple[int, ...], ...]
    bones: np.ndarray
    lengths: np.ndarray
    sights: tuple[Sight, ...]

    @classmethod
    def of(cls, character: Character) -> Tree:
        skeleton = character.skeleton
        above = character.reference_globals.take(skeleton.parents, axis=0)
        bones = rotation.rotate(above, skeleton.offsets)
        bones[0] = 0.0
        lengths = np.linalg.norm(bones, axis=1)
        bones[lengths <= NOTHING] = 0.0  # or joints are turned by the rounding of places
        owns = [tuple(c for c in below if lengths[c] > NOTHING) for below in skeleton.children]
        sights = tuple(_sight(character, j, owns, bones, lengths) for j in range(len(skeleton)))
        parents = tuple(skeleton.parents.tolist())
        return cls(character, parents, skeleton.children, frozen(bones, np.float64), lengths, sights)

    def places(self, turned: np.ndarray, root: np.ndarray) -> np.ndarray:
        """``(frames, joints, 3)`` metres, of orientations ``(frames, joints, 4)`` relative to the reference
        pose and a root ``(frames, 3)``."""
        out = np.empty((*turned.shape[:2], 3))
        out[:, 0] = root
        steps = rotation.rotate(turned.take(self.parents, axis=1), self.bones)
        for joint, parent in enumerate(self.parents[1:], 1):
            out[:, joint] = out[:, parent] + steps[:, joint]
        return out


def _sight(
    character: Character, joint: int, owns: list[tuple[int, ...]], bones: np.ndarray, lengths: np.ndarray
) -> Sight:
    own = owns[joint]
    borrowed = _borrowed(character.skeleton.children, owns, joint)
    ends = [*own, *borrowed]
    lent = _off_line(bones[ends] / lengths[ends, None])[1] if borrowed else 0.0
    axis, spread = _off_line(bones[list(own)]) if own else (np.zeros(3), 0.0)
    if (bend := _bend(character, joint, owns) if own else None) is None:
        return Sight(own, borrowed, axis, spread, lent)
    return Sight(own, borrowed, axis, spread, lent, _hinge(character, joint, *bones[list(bend)]), bend)


def _bend(character: Character, joint: int, owns: list[tuple[int, ...]]) -> tuple[int, int] | None:
    """The joints at the ends of an upper and a lower limb: by role, since sleeves and straps may leave them
    too, else where there is no choice."""
    own, limb = owns[joint], character.joints(FOLDED.get(character.roles[joint] or "", ()))
    if len(limb) == 2 and limb[0] in own and limb[1] in owns[limb[0]]:
        return limb[0], limb[1]
    alone = len(own) == 1 and len(owns[own[0]]) == 1
    return (own[0], owns[own[0]][0]) if alone else None


def _off_line(bones: np.ndarray) -> tuple[np.ndarray, float]:
    """``(3,)`` unit: the line that bones ``(bones, 3)`` lie along most, the way the longest points, and how
    far off it their ends are (the root of the sum of squares)."""
    _, sizes, axes = np.linalg.svd(bones)
    longest = bones[np.square(bones).sum(axis=1).argmax()]
    sign = -1.0 if axes[0] @ longest < 0 else 1.0
    return sign * axes[0], float(np.linalg.norm(sizes[1:]))


def _borrowed(
    children: tuple[tuple[int, ...], ...], owns: list[tuple[int, ...]], joint: int
) -> tuple[int, ...]:
    """The ends of bones that leave zero-length children, and theirs in turn."""
    ends: list[int] = []
    for child in children[joint]:
        if child not in owns[joint]:
            ends += [*owns[child], *_borrowed(children, owns, child)]
    return tuple(ends)


def _hinge(character: Character, joint: int, upper: np.ndarray, lower: np.ndarray) -> np.ndarray | None:
    """``(3,)`` unit: of knees and elbows; of four legs, whose joints are folded at rest, by that."""
    axis = character.hinge(character.roles[joint] or "")
    if axis is None:
        return None
    if character.four_legged:
        axis = np.cross(upper, lower) / (np.linalg.norm(upper) * np.linalg.norm(lower))
    along = upper / np.linalg.norm(upper)
    rest = axis - along * (along @ axis)
    size = float(np.linalg.norm(rest))
    return rest / size if size > _FOLDED else None


def goals(tree: Tree, positions: np.ndarray) -> np.ndarray:
    """``(frames, joints, 3)`` target positions: the ``positions`` with bones whose median length is the
    body's.

    Where all frames show a bone longer than it is, its direction is what can be kept: what hangs below it
    is moved along. Lengths that vary about the right one are noise and stay, for the fit to even out.
    Noise makes bones seem longer by what it adds across them, which is estimated from what it adds along.
    """
    steps = positions - positions.take(tree.parents, axis=1)
    steps[:, 0] = positions[:, 0]
    lengths = np.linalg.norm(steps[:, 1:], axis=2)
    middle = np.median(lengths, axis=0)
    noise = 1.4826 * np.median(np.abs(lengths - middle), axis=0)
    shown = np.sqrt(np.maximum(middle**2 - 2.0 * noise**2, (middle / _LONGER) ** 2))
    expected = tree.lengths[1:]
    factor = np.where(expected > NOTHING, expected, 1.0) / np.maximum(shown, NOTHING)
    steps[:, 1:] *= np.clip(np.where(expected > NOTHING, factor, 1.0), 1 / _LONGER, _LONGER)[:, None]
    out = steps
    for joint, parent in enumerate(tree.parents[1:], 1):
        out[:, joint] += out[:, parent]
    return out


# ------------------------------------------------------------------------------------- in closed form
def first(tree: Tree, positions: np.ndarray) -> np.ndarray:
    """``(frames, joints, 4)`` from the root outward: a turn that brings the bones of every joint nearest to
    the directions seen; the shortest one from the parent's orientation where they leave a twist open."""
    out = np.empty((*positions.shape[:2], 4))
    still = np.broadcast_to(rotation.identity(), out[:, 0].shape)
    for joint, (parent, sight) in enumerate(zip(tree.parents, tree.sights, strict=True)):
        above = out[:, parent] if parent >= 0 else still
        out[:, joint] = _turned(tree, sight, positions - positions[:, joint, None], above)
    return out


def _turned(tree: Tree, sight: Sight, away: np.ndarray, above: np.ndarray) -> np.ndarray:
    """``(frames, 4)`` of one joint; away: ``(frames, joints, 3)`` from it."""
    ends = [*sight.own, *sight.borrowed]
    turned = above
    if len(ends) > 1:
        bones, weights = tree.bones[ends], tree.lengths[ends]
        weights = np.where(np.arange(len(ends)) < len(sight.own), 1.0, _BORROWED) / weights.max()
        turned = wahba(unit(away[:, ends]), bones * weights[:, None], above, _ABOVE)
    for end in ends if len(ends) == 1 else sight.own if len(sight.own) == 1 else ():
        swing = rotation.between(rotation.rotate(turned, tree.bones[end]), away[:, end])
        turned = rotation.multiply(swing, turned)
    return turned


def wahba(now: np.ndarray, then: np.ndarray, above: np.ndarray, weight: float) -> np.ndarray:
    """``(frames, 4)`` the turn that brings ``then`` ``(bones, 3)`` nearest to ``now``
    ``(frames, bones, 3)``, by singular values (Markley 1988); never a mirror image. The orientation
    ``above``, with its weight, decides what the bones leave open."""
    both = np.einsum("fbi,bj->fij", now, then) + weight * rotation.to_matrix(above)
    left, _, right = np.linalg.svd(both)
    left[..., -1] *= np.linalg.det(left @ right)[:, None]
    return rotation.from_matrix(left @ right)


# ------------------------------------------------------------------------------------- Gauss-Newton
def refined(tree: Tree, start: np.ndarray, targets: np.ndarray, hold: float = 0.0) -> np.ndarray:
    """``(frames, joints, 4)`` from ``start``, of the same shape, to the least sum of squared distances from
    ``targets`` ``(frames, joints, 3)``, each frame damped as it needs (Levenberg).

    hold: square metres that a radian away from the start costs. The root stands at its target."""
    out = np.array(start)
    size = max(1, _AT_ONCE // len(tree.parents))
    for low in range(0, len(out), size):
        some = slice(low, low + size)
        _descend(_Problem(tree, start[some], targets[some], hold), out[some])
    return out


def _descend(problem: _Problem, out: np.ndarray) -> None:
    """Move ``out`` to the least cost, in place; frames that gain no more are left alone.

    Where much of the cost will stay (noise), whole steps go too far. So damping starts in proportion to it.
    """
    cost, _ = problem.cost(out)
    damping, open_ = np.maximum(_WARY * cost / problem.size, _LEAST), np.arange(len(out))
    stuck = _STUCK * damping
    for _ in range(_STEPS):
        open_ = open_[cost[open_] > problem.nothing]
        if not len(open_):
            return
        part, before = problem.at(open_), out[open_]
        turns = part.step(before, damping[open_])
        after = rotation.normalise(rotation.multiply(rotation.from_rotation_vector(turns), before))
        least, _ = part.cost(after)
        gain = cost[open_] - least
        better = gain > 0
        out[open_[better]], cost[open_[better]] = after[better], least[better]
        damping[open_] *= np.where(better, _EASE, _CARE)
        enough = gain < _GAIN * least + problem.nothing
        finished = np.where(better, enough, damping[open_] > stuck[open_])
        open_ = open_[~finished]


class _Problem:
    """Some frames of a clip, and the targets of their joints."""

    def __init__(self, tree: Tree, start: np.ndarray, targets: np.ndarray, hold: float) -> None:
        self.tree, self.start, self.targets = tree, start, targets
        longest = [max((float(tree.lengths[c]) for c in below), default=0.0) for below in tree.children]
        self.scale = np.maximum(longest, NOTHING) ** 2
        self.hold = _PULL * self.scale + hold
        self.size = float(np.square(tree.lengths).sum() + NOTHING**2)
        self.nothing = _NEAR * self.size

    def at(self, frames: np.ndarray) -> _Problem:
        part = object.__new__(_Problem)
        part.__dict__.update(self.__dict__, start=self.start[frames], targets=self.targets[frames])
        return part

    def cost(self, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``(frames,)`` square metres, and the joints' offsets from their targets."""
        off = self.tree.places(turned, self.targets[:, 0]) - self.targets
        back = self._back(turned)
        pull = self.hold @ np.square(back).sum(axis=2).T
        return np.square(off).sum(axis=(1, 2)) + pull, off

    def _back(self, turned: np.ndarray) -> np.ndarray:
        """``(frames, joints, 3)`` rotation vectors in the world that lead back to the start."""
        return rotation.to_rotation_vector(rotation.multiply(self.start, rotation.conjugate(turned)))

    def step(self, turned: np.ndarray, damping: np.ndarray) -> np.ndarray:
        """``(frames, joints, 3)`` turns in the world that lower the cost, for damping ``(frames,)``.

        Inward: (stiff, force) of a joint is the quadratic gain of all below it in its own displacement x,
        x' stiff x / 2 + force' x, after the best turn t = -gain' x - ease below it. Outward: the turns.
        """
        tree, off = self.tree, self.cost(turned)[1]
        back = self._back(turned)
        bones = rotation.rotate(turned.take(tree.parents, axis=1), tree.bones)
        frames, joints = turned.shape[:2]
        stiff = np.zeros((joints, frames, 3, 3)) + np.eye(3)
        force = np.array(off.transpose(1, 0, 2))
        gain, ease = np.zeros((joints, frames, 3, 3)), np.zeros((joints, frames, 3))
        for joint in range(joints - 1, -1, -1):
            hold = self.hold[joint]
            ease[joint] = -back[:, joint]
            if not tree.children[joint]:
                continue
            inner = (hold + damping * self.scale[joint])[:, None, None] * np.eye(3)
            push, mixed = -hold * back[:, joint], np.zeros((frames, 3, 3))
            for child in tree.children[joint]:
                lever = _lever(bones[:, child])
                carried = stiff[child] @ lever
                mixed += carried
                inner += lever.transpose(0, 2, 1) @ carried
                push += np.cross(bones[:, child], force[child])
                stiff[joint] += stiff[child]
                force[joint] += force[child]
            inverse = _inverse(inner)
            gain[joint] = mixed @ inverse
            ease[joint] = (inverse @ push[..., None])[..., 0]
            stiff[joint] -= gain[joint] @ mixed.transpose(0, 2, 1)
            force[joint] -= (gain[joint] @ push[..., None])[..., 0]
        return self._outward(bones, gain, ease)

    def _outward(self, bones: np.ndarray, gain: np.ndarray, ease: np.ndarray) -> np.ndarray:
        turns, moved = np.empty_like(bones), np.zeros_like(bones)
        for joint, parent in enumerate(self.tree.parents):
            if parent >= 0:
                moved[:, joint] = moved[:, parent] + np.cross(turns[:, parent], bones[:, joint])
            turns[:, joint] = -ease[joint] - (moved[:, joint, None] @ gain[joint])[:, 0]
        return turns


def _lever(bone: np.ndarray) -> np.ndarray:
    """``(frames, 3, 3)``: by how much a small turn moves the end of a bone, ``lever @ turn``."""
    x, y, z = bone.T
    none = np.zeros_like(x)
    return np.stack([none, z, -y, -z, none, x, y, -x, none], axis=1).reshape(-1, 3, 3)


def _inverse(m: np.ndarray) -> np.ndarray:
    """Of symmetric positive matrices ``(frames, 3, 3)``, by cofactors."""
    a, b, c, d, e, f = m[:, 0, 0], m[:, 0, 1], m[:, 0, 2], m[:, 1, 1], m[:, 1, 2], m[:, 2, 2]
    p, q, r = d * f - e * e, c * e - b * f, b * e - c * d
    s, t, u = a * f - c * c, b * c - a * e, a * d - b * b
    size = a * p + b * q + c * r
    return np.stack([p, q, r, q, s, t, r, t, u], axis=1).reshape(-1, 3, 3) / size[:, None, None]


def unit(v: np.ndarray) -> np.ndarray:
    """``(..., 3)`` of length 1; zero stays zero."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)
