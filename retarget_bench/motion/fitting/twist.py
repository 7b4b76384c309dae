"""Twists that joint positions do not show: from hinges, from the parent, and smooth in time.

A joint with one bone may turn about it and nothing moves. Angles are computed with as numbers of length 1
in the complex plane, so that they never have to be unwrapped: what speaks for an angle pulls the number
there, neighbouring frames pull at each other, and the least sum of squares is one banded system per joint.
"""

from itertools import pairwise

import numpy as np

from retarget_bench.motion import hinges, rotation
from retarget_bench.motion.fitting.bones import NOTHING, Tree
from retarget_bench.motion.roles import SIDES

_PARENT = 0.05
"""Weight of no twist against the parent, where the bone points as at rest; none where it points back."""
_OTHER_BODY = 1.0
"""The same for the twist that another body has in this motion: it reaches over 4 frames."""
_FIRMNESS = 20.0
"""Weight of neighbouring frames at 30 frames per second; the parent then reaches over 20 frames."""
_HINGE = 4.0
"""Weight of a hinge that is well bent: it reaches over 2 frames."""
_NOISES = 3.0
"""A twist is smoothed if what shows it is less than so many times the fit's own error off the line."""
_BORROWED, _LENT = 1.0, 0.2
"""Weight of the twist that bones of zero-length children show, and how far off the line they must be."""
_EVENLY, _FACING = 0.3, 100.0
"""Weight of an even share of the twist to the next joint below that shows one; of all of it at the root."""
_LEAST = 1e-3
"""Weight of no twist that always remains, so that there is an answer."""


def twisted(
    tree: Tree,
    turned: np.ndarray,
    places: np.ndarray,
    fps: float,
    noise: float,
    orientations: np.ndarray | None = None,
) -> np.ndarray:
    """``(frames, joints, 4)`` the same orientations with every twist that is not seen chosen.

    turned: of the same shape, relative to the reference pose, bones fitted.
    places: ``(frames, joints, 3)``.
    noise: metres that the fitted joints are off, by which it is judged what is seen.
    orientations: like ``turned``, of another body in this motion: how a joint is turned there against the
        one above takes the place of no turn at all.
    """
    out, choice = np.empty_like(turned), _Choice(tree, turned, places, fps, noise, orientations)
    for joint, sight in enumerate(tree.sights):
        above = choice.above(joint, out)
        if not sight.own:
            out[:, joint] = turned[:, joint] if sight.lent > _LENT else above
        elif choice.shown(joint):
            out[:, joint] = turned[:, joint]
        else:
            out[:, joint] = choice.of(joint, above)
    return out


class _Choice:
    """Evidence for the twist of the joints of a clip (arguments as in ``twisted``)."""

    def __init__(
        self,
        tree: Tree,
        turned: np.ndarray,
        places: np.ndarray,
        fps: float,
        noise: float,
        orientations: np.ndarray | None,
    ) -> None:
        self.tree, self.turned, self.places, self.others = tree, turned, places, orientations
        self.noise, self.firmness = max(noise, 1e-9), _FIRMNESS * (fps / 30.0) ** 2

    def shown(self, joint: int) -> bool:
        """True where bones show how a joint is turned, in spite of the fit's own error."""
        return self.tree.sights[joint].spread >= max(NOTHING, _NOISES * self.noise)

    def above(self, joint: int, out: np.ndarray) -> np.ndarray:
        """``(frames, 4)`` how a joint is turned if nothing is seen of it: as its parent, or as it is given
        against a joint above it."""
        base, parents, sights = self.tree.parents[joint], self.tree.parents, self.tree.sights
        if base < 0:
            return rotation.identity(len(out)) if self.others is None else self.others[:, joint]
        if self.others is None:
            return out[:, base]
        # A hinge twists the upper limb by this rig's habits, not by those of the rig that is given; and a
        # face looks where the chest lets it, even if a neck leans otherwise.
        far = self.tree.character.roles[joint] == "head"
        while parents[base] >= 0 and (sights[base].hinge is not None or (far and not self.shown(base))):
            base = parents[base]
        return self._carried(out[:, base], base, joint)

    def _carried(self, turned: np.ndarray, base: int, joint: int) -> np.ndarray:
        """``(frames, 4)`` a joint as it is given against ``base``, which has the orientation ``turned``."""
        if self.others is None:
            return turned
        against = rotation.multiply(rotation.conjugate(self.others[:, base]), self.others[:, joint])
        return rotation.multiply(turned, against)

    def of(self, joint: int, above: np.ndarray) -> np.ndarray:
        """``(frames, 4)`` of a joint whose bones lie along one line: the shortest turn there from the
        orientation ``above`` ``(frames, 4)``, then a twist about it."""
        axis = self.tree.sights[joint].axis
        there = self._there(joint)
        swung = _swung(above, axis, there)
        at_rest = 0.5 + 0.5 * _dot(rotation.rotate(above, axis), there)
        weight = _PARENT if self.others is None else _OTHER_BODY
        least = weight if self.tree.parents[joint] >= 0 else _LEAST
        pull = np.maximum(least * np.square(at_rest), _LEAST)
        targets = [(pull, np.zeros(len(pull))), self._own(joint, swung)]
        targets += [self._bent(joint, swung, there), self._below(joint, swung)]
        slip = _slip(rotation.multiply(rotation.conjugate(above), swung), axis)
        weights, angles = (np.stack(each) for each in zip(*targets, strict=True))
        return rotation.multiply(
            rotation.about(there, _smooth(weights, angles, slip, self.firmness)), swung
        )

    def _there(self, joint: int) -> np.ndarray:
        """``(frames, 3)`` where the line of a joint's bones points."""
        return rotation.rotate(self.turned[:, joint], self.tree.sights[joint].axis)

    def _own(self, joint: int, swung: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Weights ``(frames,)`` and radians of the twist that bones show, though hardly or not surely."""
        sight = self.tree.sights[joint]
        weight = (sight.spread / self.noise) ** 2 if sight.spread > NOTHING else 0.0
        weight += _BORROWED * (sight.lent > _LENT)
        between = rotation.multiply(rotation.conjugate(swung), self.turned[:, joint])
        return np.full(len(swung), weight), _twist(between, sight.axis)

    def _bent(self, joint: int, swung: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """... of the twist with which the next joint is a hinge."""
        sight = self.tree.sights[joint]
        if sight.hinge is None:
            return np.zeros(len(swung)), np.zeros(len(swung))
        (middle, end), places = sight.bend, self.places
        normal, share = hinges.bend(
            places[:, middle] - places[:, joint], places[:, end] - places[:, middle]
        )
        axis = rotation.rotate(swung, sight.hinge)
        return _HINGE * share, np.arctan2(_dot(np.cross(axis, normal), there), _dot(axis, normal))

    def _below(self, joint: int, swung: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """... of an even share of the twist to the next joint below that shows one; of all of it for the
        root, which has nothing above to differ from. Not for limbs: rigs turn hands at the wrist."""
        path = self._path(joint)
        if not path or (self.tree.character.roles[joint] or "").startswith(SIDES):
            return np.zeros(len(swung)), np.zeros(len(swung))
        carried = swung
        for parent, link in pairwise(path):
            carried = self._carried(carried, parent, link)
            if link != path[-1]:
                carried = _swung(carried, self.tree.sights[link].axis, self._there(link))
        between = rotation.multiply(self.turned[:, path[-1]], rotation.conjugate(carried))
        angle = _wrapped(_twist(between, self._there(path[-2])))
        weight = _EVENLY * (0.5 + 0.5 * np.cos(angle))
        if self.tree.parents[joint] < 0:
            return np.full(len(angle), _FACING), angle
        return weight, angle / len(path)

    def _path(self, joint: int) -> list[int]:
        """From a joint to the nearest below it with bones off one line, both included, or nothing."""
        paths = [[joint]]
        while paths:
            path = paths.pop(0)
            if path[1:] and self.tree.sights[path[-1]].spread > NOTHING:
                return path
            paths += [[*path, child] for child in self.tree.sights[path[-1]].own]
        return []


def _swung(above: np.ndarray, axis: np.ndarray, there: np.ndarray) -> np.ndarray:
    """``(frames, 4)`` the shortest turn on from ``above`` that brings ``axis`` to point to ``there``."""
    return rotation.multiply(rotation.between(rotation.rotate(above, axis), there), above)


def _twist(turns: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """``(frames,)`` radians that turns ``(frames, 4)`` twist about axes ``(..., 3)``."""
    return np.asarray(2.0 * np.arctan2((turns[:, 1:] * axis).sum(axis=1), turns[:, 0]))


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """The same angles from -pi to pi."""
    return np.asarray(angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi)))


def _slip(local: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """``(frames - 1,)`` radians by which orientations ``(frames, 4)`` without twist against the parent
    twist from one frame to the next, seen from the shortest way that the axis goes there."""
    along = rotation.rotate(local, axis)
    carried = rotation.multiply(rotation.between(along[:-1], along[1:]), local[:-1])
    return _wrapped(_twist(rotation.multiply(rotation.conjugate(local[1:]), carried), axis))


def _smooth(weights: np.ndarray, angles: np.ndarray, slip: np.ndarray, firmness: float) -> np.ndarray:
    """``(frames,)`` radians near all of ``angles`` ``(targets, frames)`` that go on by ``slip``.

    First as complex numbers u: the least sum of weight |u - e^(i angle)|^2 and firmness
    |u' - e^(i slip) u|^2, u' being the next frame's. Where targets contradict each other u may pass close
    to 0, and its angle would jump; so the same is solved for angles, each target at the turn that is
    nearest to u's.
    """
    pull = weights.sum(axis=0)
    numbers = _chain(pull, (weights * np.exp(1j * angles)).sum(axis=0), firmness * np.exp(1j * slip))
    angle = np.angle(numbers)
    steps = slip + _wrapped(np.diff(angle) - slip)
    angle = angle[0] + np.concatenate([[0.0], np.cumsum(steps)])
    goal = (weights * (angle + _wrapped(angles - angle))).sum(axis=0)
    ahead = firmness * (np.append(slip, 0.0) - np.append(0.0, slip))
    return _chain(pull, goal - ahead, np.full(len(slip), firmness)).real


def _chain(pull: np.ndarray, goal: np.ndarray, links: np.ndarray) -> np.ndarray:
    """``(frames,)`` solution of the Hermitian system with |links| ``(frames - 1,)`` between neighbours."""
    from scipy.linalg import solveh_banded  # type: ignore[import-untyped]

    if len(pull) == 1:  # which LAPACK's routine for two bands refuses
        return np.asarray(goal / pull)
    bands = np.zeros((2, len(pull)), dtype=links.dtype)
    bands[1] = pull
    bands[1, 1:] += np.abs(links)
    bands[1, :-1] += np.abs(links)
    bands[0, 1:] = -links.conj()
    return np.asarray(solveh_banded(bands, goal))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("fc,fc->f", a, b)
