"""The bodies in a scene: which nodes are joints of one skeleton."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from retarget_bench.errors import NotSupported, some
from retarget_bench.motion.bvh.recording import DUMMY_NAMES, HIP_NAMES
from retarget_bench.motion.files.scenes.scene import Nodes, Scene
from retarget_bench.motion.recording import MOST_JOINTS

_LISTED = 12


def chosen(choice: str, names: Sequence[str], kind: str, path: Path) -> int:
    """The place in ``names`` that a choice names: by its name, or its number from 1 on.

    Raises NotSupported, with what there is, where none fits.
    """
    if choice in names:
        return names.index(choice)
    plain = [name.casefold() for name in names]
    if choice.casefold() in plain:
        return plain.index(choice.casefold())
    if choice.isdecimal() and 0 < int(choice[:9]) <= len(names):
        return int(choice) - 1
    listed = some([f"{number} {name!r}" for number, name in enumerate(names, 1)], _LISTED)
    raise NotSupported(f"{path} has no {kind} {choice!r}; it has {listed or 'none'}")


_TRUNK = re.compile(
    r"(?<![a-z])(?:[Hh]ips?|HIPS?|[Pp]elvis|PELVIS|[Ss]pine|SPINE|[Tt]orso)(?![a-z])|センター|下半身|腰"
)
"""Names of nodes with a body below them."""
_PART = re.compile(r"hand|wrist|head|foot|ankle|toe|ball", re.IGNORECASE)
_END = re.compile(r"(?:end|nub|tip)(?:[ _.]?site)?\d*$", re.IGNORECASE)
"""Names of last joints, and of what ends their bones."""


@dataclass(frozen=True)
class Body:
    """A skeleton among the nodes of a file.

    joints:   its nodes, parents first; the first is the root.
    skins:    the skins on it, by number.
    left_out: joints that stand beside the root, and are not read.
    folded:   joints above the root that only carry it.
    """

    joints: tuple[int, ...]
    skins: tuple[int, ...]
    left_out: tuple[int, ...] = ()
    folded: tuple[int, ...] = ()

    def parents(self, nodes: Nodes) -> np.ndarray:
        """``(joints,)`` per joint its parent joint, -1 for the root."""
        place = {node: joint for joint, node in enumerate(self.joints)}
        return np.array([place.get(nodes.parents[node], -1) for node in self.joints])


def choose_body(scene: Scene, choice: str | None) -> tuple[Body, tuple[str, ...]]:
    """The body to read, and a note where there are several.

    choice: its number from 1 on, or the name of its root node; None: the one with most joints, among those
        of the file's own scene where there are any.
    Raises FileError where there is none, NotSupported where none has that name.
    """
    bodies = _skinned(scene) or _animated(scene)
    if not bodies:
        raise scene.fail(f"holds no skeleton: neither a skin nor {_article(scene.kind)} that turns nodes")
    names = [scene.nodes.names[body.joints[0]] for body in bodies]
    if choice is not None:
        number = chosen(choice, names, "body", scene.path)
    else:
        shown = scene.shown()
        sizes = [(body.joints[0] in shown, len(body.joints)) for body in bodies]
        number = max(range(len(bodies)), key=sizes.__getitem__)
    if len(bodies[number].joints) > MOST_JOINTS:
        raise scene.fail(f"has a body of {len(bodies[number].joints)} joints; {MOST_JOINTS} are read")
    if len(bodies) == 1:
        return bodies[number], ()
    listed = ", ".join(f"{n} {name!r}" for n, name in enumerate(names[:12], 1))
    return bodies[number], (
        f"body {number + 1} of {len(bodies)}, {names[number]!r} (body= chooses another: {listed})",
    )


def _skinned(scene: Scene) -> list[Body]:
    """Bodies with skins; skins whose joints stand in one tree are of one body."""
    nodes = scene.nodes
    groups: list[tuple[int, set[int], list[int], list[int]]] = []
    for number in range(len(scene.skins)):
        trees: dict[int, list[int]] = {}
        for joint in scene.skin_joints(number):
            trees.setdefault(nodes.tops[joint], []).append(joint)
        if not trees:
            continue
        joints = max(trees.values(), key=len)  # some programs add a joint apart, for vertices without any
        top, members, skins = nodes.meeting(joints), set(joints), [number]
        apart = [node for tree in trees.values() if tree is not joints for node in tree]
        for other in [each for each in groups if nodes.meeting((top, each[0])) in (top, each[0])]:
            groups.remove(other)
            top = nodes.meeting((top, other[0]))
            members |= other[1]
            skins += other[2]
            apart += other[3]
        groups.append((top, members, sorted(skins), apart))
    return [
        Body(_between(nodes, top, members), tuple(skins), tuple(dict.fromkeys(apart)))
        for top, members, skins, apart in groups
    ]


def _between(nodes: Nodes, top: int, members: set[int]) -> tuple[int, ...]:
    """The members and the nodes between them and ``top``, parents first."""
    included = {top}
    for node in members:
        while node not in included:
            included.add(node)
            node = nodes.parents[node]
    return tuple(node for node in nodes.below(top) if node in included)


def _animated(scene: Scene) -> list[Body]:
    """Bodies without skins: all below the node at which the animated ones of a tree meet, or below the
    first above it that is named as the trunk of a body."""
    nodes = scene.nodes
    trees: dict[int, list[int]] = {}
    for number in range(len(scene.take_names)):
        for node in scene.animated(number):
            trees.setdefault(nodes.tops[node], []).append(node)
    bodies = []
    for moved in trees.values():
        top = nodes.meeting(dict.fromkeys(moved))
        named = (node for node in nodes.above(top) if _TRUNK.search(nodes.names[node]))
        joints = nodes.below(next(named, top))
        bodies.append(Body(tuple(node for node in joints if not _ends_bone(scene, node, {*moved})), ()))
    return bodies


def _ends_bone(scene: Scene, node: int, animated: set[int]) -> bool:
    """Whether a leaf that is not animated is no joint: by its name, or below a node that is animated."""
    if node in animated or not scene.is_tip(node):
        return False
    name = scene.nodes.names[node]
    carried = scene.nodes.parents[node] in animated
    return bool(_END.search(name)) or (carried and not _PART.search(name))


def _article(kind: str) -> str:
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"


def with_moving_root(nodes: Nodes, body: Body, moves: Callable[[int, bool], bool]) -> Body:
    """The body with the joint as root that moves through the world.

    Joints above it that have one child only carry it: they are folded. A root that stands while one child
    with most of the joints moves leaves what else hangs on it (targets of inverse kinematics) behind.
    moves: of a node, whether any animation of the file moves it; with True also whether one turns it.
    """
    joints = body.joints
    while True:
        members = set(joints)
        chain = [joints[0]]
        while len(below := [node for node in nodes.children[chain[-1]] if node in members]) == 1:
            chain += below
        carried = (n for n in range(1, len(chain)) if _is_carried(nodes, chain, n, moves))
        top = max(carried, default=0)
        body = replace(body, folded=(*body.folded, *chain[:top]))
        joints = tuple(node for node in joints if node not in chain[:top])
        root = joints[0]
        below = [node for node in nodes.children[root] if node in members]
        parts = {child: [node for node in nodes.below(child) if node in members] for child in below}
        child = max(below, key=lambda node: len(parts[node]), default=root)
        if len(below) < 2 or 2 * len(parts[child]) < len(joints):
            return replace(body, joints=joints)
        if moves(root, True) or not moves(child, False):
            return replace(body, joints=joints)
        beside = [node for other in below if other != child for node in parts[other]]
        body = replace(body, folded=(*body.folded, root), left_out=(*body.left_out, *beside))
        joints = tuple(parts[child])


def _is_carried(nodes: Nodes, chain: list[int], place: int, moves: Callable[[int, bool], bool]) -> bool:
    """Whether the joints of a chain before this place only carry it: it moves against the one above, or is
    named as the hips below a dummy."""
    above, name = (nodes.names[node].lower() for node in chain[place - 1 : place + 1])
    by_name = any(word in above for word in DUMMY_NAMES) and any(word in name for word in HIP_NAMES)
    return by_name or moves(chain[place], False)
