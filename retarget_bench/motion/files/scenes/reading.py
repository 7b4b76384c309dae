"""From a scene to a body and its motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from retarget_bench.errors import some
from retarget_bench.motion import rotation
from retarget_bench.motion.files.scenes.bodies import Body, choose_body, chosen, with_moving_root
from retarget_bench.motion.files.scenes.rig import (
    Rig,
    has_surface,
    is_plain,
    orientations,
    sizes_above,
    surface,
)
from retarget_bench.motion.files.scenes.scene import Nodes, Scene, Track, nearest_turn, transform
from retarget_bench.motion.recording import Recording, reach, resting, unique_names
from retarget_bench.motion.skeleton import EndSite, Skeleton

_STILL, _SAME = 1e-3, 1e-5
"""Shares of the body's reach up to which a joint's place in its parent's frame counts as constant, and up
to which it counts as the place at rest."""
_SCALED = 1e-3
"""Share by which a scale may change during an animation and still count as constant."""


@dataclass(frozen=True, eq=False)
class _Performance:
    """The chosen animation of a body. times: ``(frames,)`` seconds."""

    tracks: Mapping[tuple[int, str], Track]
    times: np.ndarray
    fps: float

    def values(self, node: int, path: str, rest: np.ndarray) -> np.ndarray:
        """``(frames, width)`` of a node, or ``(1, width)`` where it does not change."""
        track = self.tracks.get((node, path))
        return rest[None] if track is None else track.at(self.times)


def rigged(scene: Scene, take: str | None, body: str | None) -> tuple[Rig, Recording]:
    """A body of a scene with its nodes, and its motion.

    take: by name or number from 1 on; None: the first that moves the body. body: likewise, by the name of
        its root; None: the largest.
    Raises FileError for what cannot be read, NotSupported where there is no such take or body.
    """
    chosen_body, notes = choose_body(scene, body)
    number, tracks, how = _choose_take(scene, chosen_body, take)
    times, fps, spaced = scene.frame_times(number, tracks.values())
    performance = _Performance(tracks, times, fps)
    nodes, scaled = _with_scales(scene, chosen_body, performance)
    own = _with_root(scene, nodes, chosen_body)
    notes = (*notes, f"{how}: {spaced}" if number is not None else how, *_about_root(nodes, own))
    rig, moved, replaced = _rig(scene, nodes, own, performance)
    rotations, root = _frames(rig, performance)
    roles = scene.roles(rig.body.joints)
    stated = {
        name: roles[j] for name, j in zip(rig.skeleton.names, rig.body.joints, strict=True) if j in roles
    }
    if stated:
        notes = (*notes, f"{len(stated)} joints have the roles that the file states")
    recording = Recording(
        rig.skeleton,
        rotation.continuous(rotations),
        root,
        fps,
        (*notes, *replaced),
        scaled,
        unit=scene.unit,
        up=scene.up,
        skin=partial(surface, rig) if has_surface(rig) else None,
        places=_steps(rig, moved, len(root)),
        roles=stated,
    )
    _check_finite(scene, recording)
    return rig, recording


def _about_root(nodes: Nodes, body: Body) -> list[str]:
    """Notes on the joints that are not read."""
    notes = []
    if body.left_out:
        notes.append(f"left out beside the body: {_listed(nodes, body.left_out)}")
    if body.folded:
        folded, carried = _listed(nodes, body.folded), nodes.names[body.joints[0]]
        verbs = ("only carry", "are") if len(body.folded) > 1 else ("only carries", "is")
        notes.append(f"{folded} {verbs[0]} {carried!r} and {verbs[1]} folded into it")
    return notes


def _choose_take(
    scene: Scene, body: Body, take: str | None
) -> tuple[int | None, dict[tuple[int, str], Track], str]:
    """The number of the take to read, its tracks on the body and what is above it, and a note."""
    names, kind = scene.take_names, scene.kind
    concerned = {*body.joints, *scene.nodes.above(body.joints[0])}
    numbers = scene.preferred(concerned) if take is None else [chosen(take, names, kind, scene.path)]
    for number in numbers:
        own = {(track.node, track.path): track for track in scene.tracks(number, concerned)}
        if own:
            label = f" {names[number]!r}" if names[number] else ""
            others = [f"{n} {name!r}" for n, name in enumerate(names, 1) if n != number + 1][:12]
            more = f" (take= chooses another: {', '.join(others)})" if others else ""
            return number, own, f"{kind} {number + 1} of {len(names)}{label}{more}"
    if take is not None:
        raise scene.fail(f"{kind} {take!r} moves nothing of the body {scene.nodes.names[body.joints[0]]!r}")
    return None, {}, f"no {kind} moves the body: one frame, the pose at rest"


# ---------------------------------------------------------------------------------------------- bones
def _with_scales(scene: Scene, body: Body, performance: _Performance) -> tuple[Nodes, tuple[str, ...]]:
    """The nodes with the scales that they have during the animation, and doubts where these change."""
    nodes = scene.nodes
    scale = np.array(nodes.scale)
    changing = []
    for node, path in performance.tracks:
        if path == "scale":
            values = performance.values(node, "scale", scale[node])
            scale[node] = np.median(values, axis=0)
            if (np.ptp(values, axis=0) > _SCALED * np.abs(scale[node])).any():
                changing.append(node)
    nodes = replace(nodes, scale=scale)
    concerned = [*nodes.above(body.joints[0]), *body.joints]
    if (np.abs(scale[concerned]) < 1e-12).any():
        worst = next(node for node in concerned if (np.abs(scale[node]) < 1e-12).any())
        raise scene.fail(f"scales {nodes.names[worst]!r} to nothing, so that it has no bones")
    if not changing:
        return nodes, ()
    return nodes, (
        f"the {scene.kind} changes the size of {_listed(nodes, changing)}: bones keep their length",
    )


def _with_root(scene: Scene, nodes: Nodes, body: Body) -> Body:
    """The body with the joint as root that moves through the world in any of the file's takes, so
    that it is the same body in all of them."""
    places = nodes.matrices(body.joints)
    away = [places[node][:3, 3] - places[body.joints[0]][:3, 3] for node in body.joints]
    size = float(np.linalg.norm(away, axis=1).max())

    def moves(node: int, turns: bool) -> bool:
        within = _STILL * size / max(_size(places, nodes, node), 1e-12)
        return scene.spread(node, "translation") > within or (
            turns and scene.spread(node, "rotation") > _STILL
        )

    return with_moving_root(nodes, body, moves)


def _size(places: Mapping[int, np.ndarray], nodes: Nodes, node: int) -> float:
    """The size in the world at rest of a unit step in a node's own translation."""
    parent = nodes.parents[node]
    return float(np.linalg.norm(places[parent][:3, :3], axis=0).max()) if parent in places else 1.0


def _rig(
    scene: Scene, nodes: Nodes, body: Body, performance: _Performance
) -> tuple[Rig, dict[int, np.ndarray], tuple[str, ...]]:
    """The body with its skeleton; ``(frames, 3)`` translations of joints that move against their parents;
    and notes."""
    if not is_plain(nodes, body):
        return _rig_at_rest(scene, nodes, body), {}, ("nodes are scaled unevenly: read as at rest",)
    joints, parents = list(body.joints), body.parents(nodes)
    names = unique_names(tuple(nodes.names[node] for node in joints))
    oriented, problem = orientations(scene, nodes, body)
    sizes = sizes_above(nodes, body)
    root = nodes.matrices(joints[:1])[joints[0]][:3, 3]

    def tip(joint: int, away: np.ndarray) -> np.ndarray:
        return rotation.rotate(oriented[joint], sizes[joint] * nodes.scale[joints[joint]].mean() * away)

    def skeleton(places: np.ndarray) -> Skeleton:
        offsets = rotation.rotate(oriented[parents], places * sizes[:, None])
        offsets[0] = root
        return Skeleton(names, parents, offsets, _tips(scene, nodes, body, tip))

    size = reach(skeleton(nodes.translation[joints]))
    places, moved, replaced = _places(nodes, body, performance, sizes, size)
    notes = tuple(filter(None, (problem, replaced)))
    return Rig(scene, nodes, body, skeleton(places), oriented, places), moved, notes


def _rig_at_rest(scene: Scene, nodes: Nodes, body: Body) -> Rig:
    """A body whose nodes scale unevenly or mirror, in the pose at rest."""
    joints, parents = list(body.joints), body.parents(nodes)
    matrices = nodes.matrices(joints)
    rest = np.stack([matrices[node] for node in joints])
    places = rest[:, :3, 3]
    offsets = np.where(parents[:, None] >= 0, places - places[parents], places)
    tips = _tips(scene, nodes, body, lambda joint, away: rest[joint, :3, :3] @ away)
    names = unique_names(tuple(nodes.names[node] for node in joints))
    skeleton = Skeleton(names, parents, offsets, tips)
    return Rig(scene, nodes, body, skeleton, nearest_turn(rest[:, :3, :3]), nodes.translation[joints])


def _tips(
    scene: Scene, nodes: Nodes, body: Body, placed: Callable[[int, np.ndarray], np.ndarray]
) -> tuple[EndSite, ...]:
    """A tip for every node that ends a bone without being a joint.

    placed: from a joint and a node's translation below it to the place in the skeleton's own frames.
    """
    members, sites = {*body.joints, *body.left_out}, []
    for joint, node in enumerate(body.joints):
        for child in nodes.children[node]:
            if child not in members and scene.is_tip(child):
                x, y, z = placed(joint, nodes.translation[child]).tolist()
                sites.append(EndSite(joint, (x, y, z)))
    return tuple(sites)


def _places(
    nodes: Nodes, body: Body, performance: _Performance, sizes: np.ndarray, size: float
) -> tuple[np.ndarray, dict[int, np.ndarray], str]:
    """``(joints, 3)`` the translation of every joint in its parent's frame; ``(frames, 3)`` the same of
    joints where it changes; and a note where it is another than at rest."""
    joints = list(body.joints)
    places, moved = np.array(nodes.translation[joints]), dict[int, np.ndarray]()
    away = np.zeros(len(joints))
    for joint, node in enumerate(joints[1:], 1):
        if (node, "translation") in performance.tracks:
            values = performance.values(node, "translation", places[joint])
            middle = np.median(values, axis=0)
            if sizes[joint] * np.ptp(values, axis=0).max() > _STILL * size:
                moved[joint] = values
                within = _SAME * size / sizes[joint]
                middle = resting(places[None, joint], values[:, None], within)[0]
            away[joint] = sizes[joint] * np.abs(middle - places[joint]).max()
            if _SAME * size < away[joint]:
                places[joint] = middle
    count = int((away > _SAME * size).sum())
    replaced = f"{count} joints stand up to {away.max():.4g} from their place at rest" if count else ""
    return places, moved, replaced


def _steps(rig: Rig, moved: Mapping[int, np.ndarray], frames: int) -> np.ndarray | None:
    """``(frames, joints, 3)`` every joint in its parent's frame, of nodes that move."""
    if not moved:
        return None
    steps = np.repeat(rig.skeleton.offsets[None], frames, axis=0)
    for joint, positions in moved.items():
        steps[:, joint] = rig.step(joint, positions)
    return steps


# --------------------------------------------------------------------------------------------- frames
def _frames(rig: Rig, performance: _Performance) -> tuple[np.ndarray, np.ndarray]:
    """Local rotations ``(frames, joints, 4)`` of the skeleton, and its root's places ``(frames, 3)``."""
    if not is_plain(rig.nodes, rig.body):
        return _frames_by_matrices(rig, performance)
    nodes, joints = rig.nodes, rig.body.joints
    local = np.empty((len(performance.times), len(joints), 4))
    for joint, node in enumerate(joints):
        local[:, joint] = performance.values(node, "rotation", nodes.rotation[node])
    place, heading, size = np.zeros((1, 3)), rotation.identity(1), 1.0
    for node in (*nodes.above(joints[0]), joints[0]):
        step = performance.values(node, "translation", nodes.translation[node])
        place = place + rotation.rotate(heading, size * step)
        if node != joints[0]:
            turn = performance.values(node, "rotation", nodes.rotation[node])
            heading = rotation.multiply(heading, turn)
            size *= float(nodes.scale[node].mean())
    above = np.broadcast_to(heading, (len(performance.times), 4))
    parents = rig.skeleton.parents
    rotations = rotation.multiply(local, rotation.conjugate(rig.orientation))
    rotations[:, 1:] = rotation.multiply(rig.orientation[parents[1:]], rotations[:, 1:])
    rotations[:, 0] = rotation.multiply(above, rotations[:, 0])
    return rotations, np.array(np.broadcast_to(place, (len(performance.times), 3)))


def _frames_by_matrices(rig: Rig, performance: _Performance) -> tuple[np.ndarray, np.ndarray]:
    """Likewise for nodes that scale unevenly or mirror: the turn of every joint since the pose at rest."""
    nodes, joints, parents = rig.nodes, rig.body.joints, rig.skeleton.parents
    frames = len(performance.times)
    world: dict[int, np.ndarray] = {}
    for node in (*nodes.above(joints[0]), *joints):
        local = transform(
            performance.values(node, "translation", nodes.translation[node]),
            performance.values(node, "rotation", nodes.rotation[node]),
            nodes.scale[node],
        )
        parent = nodes.parents[node]
        world[node] = world[parent] @ local if parent in world else local
    back = np.linalg.inv(rig.matrices[:, :3, :3])
    turned = np.empty((frames, len(joints), 4))
    for joint, node in enumerate(joints):
        turned[:, joint] = nearest_turn(world[node][:, :3, :3] @ back[joint])
    rotations = np.array(turned)
    rotations[:, 1:] = rotation.multiply(rotation.conjugate(turned[:, parents[1:]]), turned[:, 1:])
    place = np.array(np.broadcast_to(world[joints[0]][:, :3, 3], (frames, 3)))
    return rotations, place


def _check_finite(scene: Scene, recording: Recording) -> None:
    arrays = (recording.rotations, recording.root, recording.skeleton.offsets)
    if not all(np.isfinite(each).all() and np.abs(each).max(initial=0.0) < 1e9 for each in arrays):
        raise scene.fail("holds numbers that are no motion of a body: it is damaged")


def _listed(nodes: Nodes, listed: Sequence[int]) -> str:
    return some([repr(nodes.names[node]) for node in listed])
