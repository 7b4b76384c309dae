"""A body of a scene as a skeleton: bones, and the pose in which they stand unturned.

Files state every joint's frame freely, and the pose at rest is often a frame of some animation. So joints
are given frames that are parallel to the world in the *bind pose*, in which the skin lies on the joints
(inverse bind matrices), or in the pose at rest where there is no skin. That pose is the skeleton's, and one
that a body can take.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.files.scenes.bodies import Body
from retarget_bench.motion.files.scenes.nodes import Nodes, nearest_turn, transform
from retarget_bench.motion.files.scenes.scene import Scene
from retarget_bench.motion.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Rig:
    """A body with its skeleton.

    nodes:       of the scene, with the scales that they have in the take.
    skeleton:    in the file's unit and axes; its joints are ``body.joints``.
    orientation: ``(joints, 4)`` orientations that the nodes have in the world while the skeleton stands
                 unturned.
    places:      ``(joints, 3)`` the nodes' own translations in that pose.
    """

    scene: Scene
    nodes: Nodes
    body: Body
    skeleton: Skeleton
    orientation: np.ndarray
    places: np.ndarray

    @cached_property
    def sizes(self) -> np.ndarray:
        """``(joints,)`` metres that a node's own translation of 1 measures."""
        return sizes_above(self.nodes, self.body)

    def step(self, joint: int, translations: np.ndarray) -> np.ndarray:
        """``(frames, 3)`` a joint in its parent's frame, of its node's ``translations`` ``(frames, 3)``."""
        above = self.orientation[self.skeleton.parents[joint]]
        return np.asarray(rotation.rotate(above[None], translations * self.sizes[joint]))

    def translations(self, joint: int, steps: np.ndarray) -> np.ndarray:
        """``step`` backwards."""
        above = rotation.conjugate(self.orientation[self.skeleton.parents[joint]])
        return np.asarray(rotation.rotate(above[None], steps) / self.sizes[joint])

    @cached_property
    def matrices(self) -> np.ndarray:
        """``(joints, 4, 4)`` the nodes' transforms in the world while the skeleton stands unturned."""
        joints = list(self.body.joints)
        if not is_plain(self.nodes, self.body):
            by_node = self.nodes.matrices(joints)
            return np.stack([by_node[node] for node in joints])
        scale = self.nodes.scale[joints] * self.sizes[:, None]
        return transform(self.skeleton.rest_positions, self.orientation, scale)


def is_plain(nodes: Nodes, body: Body) -> bool:
    """Whether all nodes that carry others scale alike in all directions, so that no bone is sheared."""
    carrying = [*nodes.above(body.joints[0]), *(node for node in body.joints if nodes.children[node])]
    return bool(nodes.plain[carrying].all())


def sizes_above(nodes: Nodes, body: Body) -> np.ndarray:
    """``(joints,)`` the scale of all nodes above each joint, multiplied."""
    scale = nodes.scale.mean(axis=1)
    scales: dict[int, float] = {body.joints[0]: float(np.prod(scale[nodes.above(body.joints[0])]))}
    for node in body.joints[1:]:
        parent = nodes.parents[node]
        scales[node] = scales[parent] * float(scale[parent])
    return np.array([scales[node] for node in body.joints])


def orientations(scene: Scene, nodes: Nodes, body: Body) -> tuple[np.ndarray, str]:
    """``(joints, 4)`` orientations of the nodes in the bind pose, and a note where it cannot be used.

    A skin tells how its joints stand to each other. Where the scene does not say how they stood in the
    world, the first joint of the largest skin stands as at rest. Joints without a skin stand to their
    parents as at rest.
    """
    resting = _at_rest(nodes, body)
    bound: dict[int, np.ndarray] = {}
    for skin in sorted(body.skins, key=lambda number: -len(scene.skin_joints(number))):
        own = _turns_of_skin(scene, body, skin)
        if own is None:
            return (
                resting,
                f"{scene.skins[skin]} has bind matrices without an inverse: the pose at rest is used",
            )
        if own:
            anchor = next((joint for joint in own if joint in bound), min(own))
            base = scene.bind_turn(skin)
            if base is None:
                anchored = bound.get(anchor, resting[anchor])
                base = rotation.multiply(anchored, rotation.conjugate(own[anchor]))
            bound = {joint: rotation.multiply(base, turn) for joint, turn in own.items()} | bound
    orientations = np.array(resting)
    for joint, parent in enumerate(body.parents(nodes).tolist()):
        if joint in bound:
            orientations[joint] = bound[joint]
        elif parent >= 0:
            orientations[joint] = rotation.multiply(
                orientations[parent], nodes.rotation[body.joints[joint]]
            )
    return rotation.normalise(orientations), ""


def _turns_of_skin(scene: Scene, body: Body, skin: int) -> dict[int, np.ndarray] | None:
    """Joint -> ``(4,)`` its orientation in the mesh's space in the bind pose, for the joints of the body
    that a skin binds; None where a matrix has no inverse."""
    matrices = scene.bind_matrices(skin)
    if matrices is None:
        return {}
    linear = matrices[:, :3, :3]
    if (np.abs(np.linalg.det(linear)) < 1e-30).any():
        return None
    turned = rotation.conjugate(nearest_turn(linear))  # the matrices lead from the mesh to the joints
    place = {node: joint for joint, node in enumerate(body.joints)}
    joints = scene.skin_joints(skin)
    return {place[node]: turned[n] for n, node in enumerate(joints) if node in place}


def _at_rest(nodes: Nodes, body: Body) -> np.ndarray:
    """``(joints, 4)`` orientations of the nodes at rest."""
    turned: dict[int, np.ndarray] = {}
    for node in (*nodes.above(body.joints[0]), *body.joints):
        parent = nodes.parents[node]
        own = nodes.rotation[node]
        turned[node] = rotation.multiply(turned[parent], own) if parent in turned else own
    return np.stack([turned[node] for node in body.joints])
