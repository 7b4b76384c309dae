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
from retarget_bench.motion.files.scenes.scene import Nodes, Piece, Scene, Surface, nearest_turn, transform
from retarget_bench.motion.mesh import Mesh
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


_FARTHEST = 1e9
_MOST_WEIGHTS = 1 << 27
"""Vertices times joints: 1 GB of weights."""


def has_surface(rig: Rig) -> bool:
    """Whether a mesh that can be read follows the body."""
    return bool(_surfaces(rig))


def _surfaces(rig: Rig) -> list[Surface]:
    """The meshes on the body: those that follow its skins, and others at or below a joint."""
    joints, surfaces = set(rig.body.joints), []
    for each in rig.scene.surfaces():
        if each.skin is not None:
            on_body = each.skin in rig.body.skins
        else:
            on_body = bool(joints & {each.node, *rig.nodes.above(each.node)})
        if on_body:
            surfaces.append(each)
    return surfaces


def surface(rig: Rig) -> Mesh:
    """The triangles of all meshes on a body, in the file's unit and axes, the skeleton unturned.

    Skinned meshes follow their joints; other meshes below a joint follow that joint. Morph targets, points
    and lines are left out. Raises FileError where the arrays do not fit.
    """
    parts = [(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), np.zeros((0, len(rig.skeleton))))]
    count = 0
    for each in _surfaces(rig):
        for piece in rig.scene.pieces(each):
            _check_size(rig, each, piece)
            if each.skin is not None and piece.weights is not None:
                places, weights = _skinned(rig, each.skin, piece.vertices, piece.weights)
            else:
                places, weights = _carried(rig, each.node, piece.vertices)
            parts.append((places, piece.faces + count, weights))
            count += len(places)
    places, faces, weights = (np.concatenate(each) for each in zip(*parts, strict=True))
    mirrored = np.linalg.det(rig.matrices[0, :3, :3]) < 0
    return Mesh(places, faces[:, ::-1] if mirrored else faces, weights)


def _check_size(rig: Rig, of: Surface, piece: Piece) -> None:
    by, count = f"meshes[{of.number}]", len(piece.vertices)
    if count * len(rig.skeleton) > _MOST_WEIGHTS:
        raise rig.scene.fail(f"{by} has {count} vertices on {len(rig.skeleton)} joints: too many")
    if np.abs(piece.vertices).max(initial=0.0) > _FARTHEST:
        raise rig.scene.fail(f"{by} has vertices beyond {_FARTHEST:g}: it is damaged")


def _skinned(rig: Rig, skin: int, places: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places ``(vertices, 3)`` in the skeleton's own pose, and weights ``(vertices, joints)``."""
    bound, joints = rig.scene.bind_matrices(skin), rig.scene.skin_joints(skin)
    place = {each: joint for joint, each in enumerate(rig.body.joints)}
    standing = rig.nodes.matrices(joints)
    matrices = np.stack([rig.matrices[place[each]] if each in place else standing[each] for each in joints])
    if bound is not None:
        matrices = matrices @ bound
    blended = (weights @ matrices.reshape(len(joints), 16)).reshape(-1, 4, 4)
    moved = np.einsum("vab,vb->va", blended[:, :3, :3], places) + blended[:, :3, 3]
    own = np.zeros((len(places), len(rig.skeleton)))
    for column, each in enumerate(joints):
        own[:, _joint_of(rig, place, each)] += weights[:, column]
    return moved, own


def _joint_of(rig: Rig, place: dict[int, int], node: int) -> int:
    """The joint of the skeleton that a joint of a skin belongs to: itself, or the closest above, or the
    root."""
    while node >= 0 and node not in place:
        node = rig.nodes.parents[node]
    return place.get(node, 0)


def _carried(rig: Rig, node: int, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A mesh that hangs on a joint without a skin."""
    place = {each: joint for joint, each in enumerate(rig.body.joints)}
    nodes, local = rig.nodes, np.eye(4)
    while node not in place:
        own = transform(nodes.translation[node], nodes.rotation[node], nodes.scale[node])
        local, node = own @ local, nodes.parents[node]
    matrix = rig.matrices[place[node]] @ local
    weights = np.zeros((len(places), len(rig.skeleton)))
    weights[:, place[node]] = 1.0
    return places @ matrix[:3, :3].T + matrix[:3, 3], weights
