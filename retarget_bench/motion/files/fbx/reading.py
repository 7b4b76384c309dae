"""An FBX file as a scene, and the motion in it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.files.fbx import child
from retarget_bench.motion.files.fbx.content import Content, extract
from retarget_bench.motion.files.scenes.reading import rigged
from retarget_bench.motion.files.scenes.roles import roles_of
from retarget_bench.motion.files.scenes.scene import (
    Nodes,
    Piece,
    Scene,
    Surface,
    Track,
    nearest_turn,
    shares_of_one,
)
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.recording import Recording

_UNITS = {1.0: "m", 0.01: "cm", 0.001: "mm", 0.1: "dm", 0.0254: "inch"}
_AXES = ("x", "-x", "y", "-y", "z", "-z")
"""Axes by the numbers that ufbx gives them."""
_CHAINS = ("Spine", "Neck")
_FARTHEST = 1e9
_DENSER = 1.02
"""Keys that are so much denser than frames are said to be."""


def read(path: Path, take: str | None = None, body: str | None = None) -> Recording:
    """The motion of a body in a file, in its own axes and unit; both are stated by the file.

    take: by name or number from 1 on; None: the first that moves the body. body: likewise, by the name of
        its root.
    Raises FileError for what cannot be read, NotSupported where there is no such take or body, or no ufbx.
    """
    scene = FbxScene(path, extract(path, take or ""))
    recording = rigged(scene, take, body)[1]
    recording = replace(
        recording, doubts=(*recording.doubts, *scene.doubts), rate_stated=scene.rate_by != "is usual"
    )
    return recording if scene.unit else _in_metres(recording, scene.content.facts["unit"])


def takes(path: Path) -> tuple[str, ...]:
    """The names of a file's takes. Raises FileError; NotSupported without ufbx."""
    return tuple(extract(path, child.NO_TAKE).facts["takes"])


class FbxScene(Scene):
    """The nodes, skins, takes and meshes of a file. Raises FileError where they are damaged.

    Joints of one skeleton are those of its skins and all nodes that the file calls bones. A file states its
    unit and axes; ``unit`` is "" for units without a name.
    """

    kind = "take"

    def __init__(self, path: Path, content: Content) -> None:
        self.path, self.content = path, content
        arrays, facts = content.arrays, content.facts
        parents = arrays["parents"].tolist()
        rest = arrays["rest"]
        if not np.isfinite(rest).all() or np.abs(rest).max(initial=0.0) > _FARTHEST:
            raise self.fail("has nodes at places that are no numbers, or too far away: it is damaged")
        children: list[list[int]] = [[] for _ in parents]
        depths = [0] * len(parents)
        for node, parent in enumerate(parents):  # ufbx lists parents first
            if parent >= 0:
                children[parent].append(node)
                depths[node] = depths[parent] + 1
        names = tuple(name.strip() or f"node_{n}" for n, name in enumerate(facts["names"]))
        turned = rotation.normalise(rest[:, 3:7])
        self.nodes = Nodes(names, parents, children, depths, rest[:, :3], turned, rest[:, 7:])
        self.unit = next((name for metres, name in _UNITS.items() if _same(metres, facts["unit"])), "")
        up = facts["axes"][1]
        self.up = _AXES[up] if up < len(_AXES) else ""
        self._skins = [self._skin(number) for number in range(self._count("skin_joints_"))]
        self._bones = self._trees_of_bones()

    def _count(self, prefix: str) -> int:
        return sum(name.startswith(prefix) for name in self.content.arrays)

    def _skin(self, number: int) -> tuple[list[int], np.ndarray, np.ndarray]:
        """Joints of a skin; matrices from its mesh to them and from them to the world, as it was bound."""
        arrays = self.content.arrays
        matrices, worlds = arrays[f"skin_matrices_{number}"], arrays[f"skin_worlds_{number}"]
        for each in (matrices, worlds):
            if not np.isfinite(each).all() or np.abs(each).max() > _FARTHEST:
                raise self.fail("has a skin that is bound by matrices without numbers: it is damaged")
        return arrays[f"skin_joints_{number}"].tolist(), matrices, worlds

    def _trees_of_bones(self) -> list[list[int]]:
        """All bones below each bone that has none above it."""
        bones = self.content.arrays["bones"].tolist()
        carried = [False] * len(bones)  # by another bone
        for node, parent in enumerate(self.nodes.parents):  # parents first
            carried[node] = parent >= 0 and (bones[parent] or carried[parent])
        tops = [node for node, bone in enumerate(bones) if bone and not carried[node]]
        return [[node for node in self.nodes.below(top) if bones[node]] for top in tops]

    # ----------------------------------------------------------------------------------------- bodies
    def roles(self, joints: Sequence[int]) -> Mapping[int, str]:
        return roles_by_links(self.content.facts["characters"], joints)

    @property
    def skins(self) -> Sequence[str]:
        return [f"skin {n}" for n in range(1, len(self._skins) + 1)] + ["bones"] * len(self._bones)

    def skin_joints(self, number: int) -> list[int]:
        return [*(skin[0] for skin in self._skins), *self._bones][number]

    def bind_matrices(self, number: int) -> np.ndarray | None:
        return self._skins[number][1] if number < len(self._skins) else None

    def bind_turn(self, number: int) -> np.ndarray | None:
        if number >= len(self._skins):
            return None
        _, matrices, worlds = self._skins[number]
        return nearest_turn((worlds @ matrices)[0, :3, :3])

    def is_tip(self, node: int) -> bool:
        return not self.nodes.children[node] and bool(self.content.arrays["plain"][node])

    # ------------------------------------------------------------------------------------------ takes
    @property
    def take_names(self) -> tuple[str, ...]:
        return tuple(self.content.facts["takes"])

    def animated(self, number: int) -> Iterable[int]:
        moved = self.content.arrays["spreads"][number, :, :2] > 0
        return np.flatnonzero(moved.any(axis=1)).tolist()

    def spread(self, node: int, path: str) -> float:
        spreads = self.content.arrays["spreads"][:, node]
        if path == "translation":
            return float(spreads[:, 0].max(initial=0.0))
        return min(math.radians(float(spreads[:, 1].max(initial=0.0))) / 2, 1.0)

    def preferred(self, only: Container[int]) -> Iterable[int]:
        """Takes that change something before those that hold the body in one pose."""
        spreads = self.content.arrays["spreads"][
            :, [n for n in range(len(self.nodes.parents)) if n in only]
        ]
        return sorted(range(len(spreads)), key=lambda number: not (spreads[number] > 0).any())

    def tracks(self, number: int, only: Container[int]) -> list[Track]:
        self._bake(number)
        arrays, tracks = self.content.arrays, []
        times = arrays["times"]
        for place, node in enumerate(arrays["moved"].tolist()):
            for path in ("translation", "rotation", "scale") if node in only else ():
                values = arrays[f"moved_{path}_{place}"]
                if not np.isfinite(values).all() or np.abs(values).max(initial=0.0) > _FARTHEST:
                    raise self.fail(f"moves {self.nodes.names[node]!r} to where no body is: it is damaged")
                own = times if len(values) == len(times) else times[:1]
                tracks.append(Track(node, path, own, values, "LINEAR"))
        return tracks

    def _bake(self, number: int) -> None:
        """Have the frames of a take where those of another were read."""
        if self.content.facts.get("baked") != number:
            self.content = extract(self.path, str(number + 1))
            if self.content.facts.get("baked") != number:
                raise self.fail("was changed while it was read: read it again")

    def frame_times(
        self,
        number: int | None,
        tracks: Iterable[Track],  # noqa: ARG002
    ) -> tuple[np.ndarray, float, str]:
        facts = self.content.facts
        if number is None:
            rate = facts["fps"]
            return np.zeros(1), rate if 1 <= rate <= 1000 else 30.0, "holds one pose"
        rate = facts["rate"]
        return self.content.arrays["times"], rate, f"{rate:g} per second, as {self.rate_by}"

    @property
    def rate_by(self) -> str:
        """The origin of the frame rate, as the end of a sentence."""
        facts = self.content.facts
        rate = facts.get("rate", facts["fps"])
        if facts["rate_stated"] and _same(rate, facts["fps"]):
            return "the file says"
        return "its keys are spaced" if _same(rate, facts.get("keys_per_second", 0.0)) else "is usual"

    @property
    def doubts(self) -> tuple[str, ...]:
        """The parts of the take that are not kept."""
        facts = self.content.facts
        rate, spaced = facts.get("rate", 0.0), facts.get("keys_per_second", 0.0)
        if not rate or spaced <= _DENSER * rate:
            return ()
        return (
            f"its keys are {spaced:.4g} per second, and the file says {rate:.4g}: what lies between its "
            "frames is not read",
        )

    # ----------------------------------------------------------------------------------------- meshes
    def surfaces(self) -> list[Surface]:
        rows = self.content.arrays["surfaces"].tolist()
        return [Surface(node, mesh, skin if skin >= 0 else None) for node, mesh, skin in rows]

    def pieces(self, surface: Surface) -> Iterator[Piece]:
        arrays = self.content.arrays
        vertices, faces = arrays[f"vertices_{surface.number}"], arrays[f"faces_{surface.number}"]
        if not np.isfinite(vertices).all():
            raise self.fail("has a mesh with vertices that are no numbers: it is damaged")
        if len(faces) and not 0 <= int(faces.min()) <= int(faces.max()) < len(vertices):
            raise self.fail("has a mesh with faces of vertices that it has not: it is damaged")
        if surface.skin is not None:
            yield Piece(vertices, faces, self._weights(surface.skin, len(vertices)))
            return
        matrix = arrays["geometry"][[row.node for row in self.surfaces()].index(surface.node)]
        yield Piece(vertices @ matrix[:3, :3].T + matrix[:3, 3], faces, None)

    def _weights(self, skin: int, vertices: int) -> np.ndarray:
        """``(vertices, joints of the skin)`` shares that sum to 1."""
        rows = self.content.arrays[f"skin_weights_{skin}"]
        weights = np.zeros((vertices, len(self.skin_joints(skin))))
        joints, places, shares = rows[:, 0].astype(np.int64), rows[:, 1].astype(np.int64), rows[:, 2]
        if not np.isfinite(shares).all() or np.abs(shares).max(initial=0.0) > 1e6:
            raise self.fail("has a skin with weights that are no numbers: it is damaged")
        used = (shares > 0) & (places >= 0) & (places < vertices)
        np.add.at(weights, (places[used], joints[used]), shares[used])
        return shares_of_one(weights)


def roles_by_links(characters: Sequence[Mapping[str, int]], joints: Sequence[int]) -> dict[int, str]:
    """Node -> role, by the HumanIK character that has most links to the joints of a body.

    characters: of each its links, by the property without ``Link`` (``LeftUpLeg``), and their nodes.
    """
    own = [{link: node for link, node in links.items() if node in joints} for links in characters]
    links = max(own, key=len, default={})
    spine, neck = (sorted(filter(re.compile(f"{stem}[1-9]?").fullmatch, links)) for stem in _CHAINS)
    role_of = roles_of(links, spine, neck)
    return {node: role_of[link] for link, node in links.items() if link in role_of}


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= 1e-6 * abs(one)


# ----------------------------------------------------------------------------------------------- unit
def _in_metres(recording: Recording, metres: float) -> Recording:
    """A recording in a unit without a name, in metres."""
    if not (math.isfinite(metres) and 1e-6 <= metres <= 1e6):
        return recording
    return replace(
        recording,
        skeleton=recording.skeleton.scaled(metres),
        root=recording.root * metres,
        places=None if recording.places is None else recording.places * metres,
        notes=(*recording.notes, f"its unit is {metres:.6g} m: read in metres"),
        unit="m",
        skin=recording.skin and partial(_scaled, recording.skin, metres),
    )


def _scaled(skin: Callable[[], Mesh], metres: float) -> Mesh:
    return skin().scaled(metres)
