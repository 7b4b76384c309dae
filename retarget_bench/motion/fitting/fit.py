"""From joint positions to rotations: the motion of a body that comes nearest to positions of its joints.

Bones of the result have the body's lengths, whatever the positions say. How a joint is turned is seen from
the joints that hang on it:

1. In closed form, from the root outward: several bones that leave a joint in different directions fix it
   (Wahba's problem), one bone is reached by the shortest turn from the reference pose as the parent carries
   it (``bones.first``).
2. Gauss-Newton steps over the whole body bring all joints nearest to their places together, damped
   towards that start. Bones that the whole clip shows longer or shorter than they are keep their
   directions instead (``bones.goals``).
3. Twists that no position shows are chosen: knees and elbows bend about their hinges, else there is no
   twist against the parent, and nothing jumps from frame to frame (``twist.py``). The rest of the body
   then gives way to twists that are shown too weakly to be left to noise.

Joints that nothing hangs on follow their parents. Where positions were retargeted from a motion with
rotations, both are as they are there against the parent. The root joint is where it was seen, exactly.
"""

from dataclasses import dataclass

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.motion import transfer
from retarget_bench.motion.character import Motion, Positions, Surface
from retarget_bench.motion.fitting import bones, twist
from retarget_bench.motion.motion import Source

_HOLD = 30.0
"""Squares of the fit's own error that a radian away from the chosen twists costs."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A motion, and ``distances`` ``(frames, joints)`` metres of its joints from the positions given."""

    motion: Motion
    distances: np.ndarray

    @property
    def mean(self) -> float:
        """Metres, over all frames and all joints but the root, which is fitted exactly."""
        return float(self.distances[:, 1:].mean()) if self.distances[:, 1:].size else 0.0

    @property
    def worst(self) -> float:
        """Metres: the largest of all."""
        return float(self.distances.max(initial=0.0))

    def __str__(self) -> str:
        joint = self.motion.skeleton.names[int(self.distances.max(axis=0, initial=0.0).argmax())]
        return f"{100 * self.mean:.1f} cm mean, {100 * self.worst:.1f} cm worst ({joint})"


def fit(positions: Positions | Surface, source: Source | None = None) -> Fitted:
    """The motion of the same character, frames and rate that comes nearest to positions of its joints, or
    to the joints under its surface.

    source: a motion that these positions were retargeted from, with as many frames, on any body. If it has
    rotations, what positions leave open is turned as there.
    Raises BenchError where a position is not finite.
    """
    places, character = positions.positions, positions.character
    bad = ~np.isfinite(places).all(axis=2)
    if bad.any():
        frame, joint = np.argwhere(bad)[0].tolist()
        raise BenchError(
            f"no rotations can be fitted to positions of {character.name}: in "
            f"{int(bad.any(axis=1).sum())} of {len(bad)} frames some are not finite, the first being "
            f"{positions.skeleton.names[joint]!r} in frame {frame}"
        )
    if not len(places):
        empty = character.motion(np.zeros((0, places.shape[1], 4)), np.zeros((0, 3)), positions.fps)
        return Fitted(empty, np.zeros(places.shape[:2]))
    tree = bones.Tree.of(character)
    targets = bones.goals(tree, places)
    turned = bones.refined(tree, bones.first(tree, targets), targets)
    off = np.square(tree.places(turned, targets[:, 0]) - targets).sum(axis=2)[:, 1:]
    noise = float(np.sqrt(off.mean())) if off.size else 0.0
    orientations = transfer.orientations(source, character) if isinstance(source, Motion) else None
    turned = twist.twisted(tree, turned, targets, positions.fps, noise, orientations)
    turned = bones.refined(tree, turned, targets, _HOLD * noise**2)
    motion = character.motion(
        transfer.from_relative(character, turned), positions.root.copy(), positions.fps
    )
    return Fitted(motion, np.linalg.norm(motion.positions - places, axis=2))
