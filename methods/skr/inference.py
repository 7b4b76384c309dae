"""Joints of sets of points, and of the motions whose surface the points are drawn from."""

from collections.abc import Sequence

import numpy as np
import torch

from retarget_bench.errors import NotSupported
from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import JOINTS, Body22
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.motion import Prediction
from retarget_bench.motion.point_sets import PointSets
from retarget_bench.motion.structures import BODY22
from retarget_bench.motion.surface_sampling import sampled

from .network import SkeletonRegressor

_ROWS = 8
"""Sets of equally many points that go through the network at once: frames times views."""


VIEWS = np.array([[1, 1, 1], [-1, 1, -1], [-1, 1, 1], [1, 1, -1]], dtype=np.float32)
"""Factors of positions: unchanged, turned about, mirrored, and both."""
LEAST = 128
"""Points that a view shows at least, as in training; of fewer than four times as many each shows all."""
_OTHER = {"left": "right", "right": "left"}
_PARTNERS = [BODY22.index("_".join(_OTHER.get(word, word) for word in role.split("_"))) for role in BODY22]
"""The joint on the other side of each of the 22."""


def joints_of(network: SkeletonRegressor, points: Sequence[np.ndarray], views: int = 1) -> np.ndarray:
    """``(frames, 22, 3)`` metres: the joints under the points ``(V, 3)`` of each frame, by a network in
    evaluation mode. V may differ between frames, and neither the order of points nor what stands beside a
    frame changes anything.

    views: in how many of ``VIEWS`` the points are seen. They are shared out among them, where there are
        enough, so that more views take little longer; the answer is the mean of all.
    """
    joints = np.empty((len(points), JOINTS, 3))
    for first, last in _alike([len(each) for each in points], max(1, _ROWS // views)):
        # far from the origin single precision is coarse, so the mean is taken off before
        middle = np.stack([each.mean(axis=0, dtype=np.float64) for each in points[first:last]])[:, None]
        near = (np.stack(points[first:last]) - middle).astype(np.float32)
        shares = views if near.shape[1] >= views * LEAST else 1
        if shares > 1:  # by where they lie, so that their order makes no difference
            near = np.stack([row[np.lexsort(row.T[[2, 0, 1]])] for row in near])
        signs = VIEWS[:views]
        answers = _estimates(
            network, [near[:, k % shares :: shares] * each for k, each in enumerate(signs)]
        )
        back = [
            (answer if each.prod() > 0 else answer[:, _PARTNERS]) * each
            for answer, each in zip(answers, signs, strict=True)
        ]
        joints[first:last] = np.mean(back, axis=0, dtype=np.float64) + middle
    return joints


def _estimates(network: SkeletonRegressor, seen: Sequence[np.ndarray]) -> list[np.ndarray]:
    """``(frames, 22, 3)`` for each view's points ``(frames, V, 3)``: the joints under them, as they look
    there. Views of equally many points, all or all but the last few, go through the network together."""
    answers: list[np.ndarray] = []
    for first, last in _alike([rows.shape[1] for rows in seen], len(seen)):
        rows = torch.from_numpy(np.concatenate(seen[first:last])).to(network.last.weight.device)
        with torch.inference_mode():
            answers += np.split(network(rows).cpu().numpy(), last - first)
    return answers


def _alike(counts: Sequence[int], most: int) -> list[tuple[int, int]]:
    """First and last (excluded) of at most so many neighbours with equally many points."""
    runs, first = [], 0
    for place in range(1, len(counts) + 1):
        ended = place == len(counts) or counts[place] != counts[first]
        if ended or place - first == most:
            runs.append((first, place))
            first = place
    return runs


def points_of(source: Prediction | PointSets, number: int, seed: int) -> Sequence[np.ndarray]:
    """A source's points; of a motion so many drawn from its body's surface, other ones in every frame.

    Raises NotSupported for a motion without rotations or without a mesh.
    """
    if isinstance(source, PointSets):
        return source.points
    if not isinstance(source, Motion) or (mesh := source.character.mesh) is None:
        raise NotSupported("skr needs points, or rotations of a body with a mesh to draw points from")
    numbers = np.random.default_rng(seed)
    drawn = sampled(mesh.skinned(source), mesh.faces, numbers.random((source.frames, 3, number)))
    return list(drawn)


def placed(target: Character, joints: np.ndarray) -> np.ndarray:
    """``(frames, joints of the target, 3)`` metres from the 22 ``(frames, 22, 3)``.

    Joints that are none of the 22 (tips, split bones) are where they are in the reference pose, seen from
    their parent, turned with the bone that leads on to one of the 22, or else with the one to the parent.
    """
    body, skeleton = Body22.of(target), target.skeleton
    own = dict(zip(body.joints, range(JOINTS), strict=True))
    rest = target.reference_places
    places = np.empty((len(joints), len(skeleton), 3))
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if joint in own:
            places[:, joint] = joints[:, own[joint]]
            continue
        if parent < 0:
            places[:, joint] = joints[:, 0] + rest[joint] - rest[body.joints[0]]
            continue
        end = _known_below(target, joint, own)
        above = int(skeleton.parents[parent])
        here, there = (parent, end) if end is not None else (max(above, 0), parent)
        direction = (joints[:, own[end]] if end is not None else places[:, there]) - places[:, here]
        turn = rotation.between(np.broadcast_to(rest[there] - rest[here], direction.shape), direction)
        bone = np.broadcast_to(rest[joint] - rest[parent], direction.shape)
        places[:, joint] = places[:, parent] + rotation.rotate(turn, bone)
    return places


def _known_below(target: Character, joint: int, own: dict[int, int]) -> int | None:
    """The first joint of the 22 that hangs below this one."""
    waiting = list(target.skeleton.children[joint])
    while waiting:
        below = waiting.pop(0)
        if below in own:
            return below
        waiting += target.skeleton.children[below]
    return None
