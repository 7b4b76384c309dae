"""Drawn bodies: thickness of bones, and the polygons of a picture."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import ancestors, body_part, common_ancestor, is_finger, is_tip
from retarget_bench.viewer.camera import Camera
from retarget_bench.viewer.colours import GRID, LIT, Colour, shade, tints
from retarget_bench.viewer.scene import Figure

LIMBS = {
    "up_leg": (0.044, 0.046),
    "leg": (0.046, 0.029),
    "foot": (0.029, 0.019),
    "toe": (0.021, 0.015),
    "shoulder": (0.048, 0.038),
    "arm": (0.034, 0.031),
    "forearm": (0.029, 0.021),
    "hand": (0.021, 0.015),
}
"""Role of a bone's end, without its side -> radii at both ends, in heights."""
PARTS = {"trunk": (0.058, 0.062), "head": (0.03, 0.028), "tail": (0.015, 0.009)}
FINGER = (0.007, 0.006)
HEAD = 0.052
"""Radius of a head, in heights."""
PLAIN = 0.14
"""Radius of a bone that has no role, in its own length."""
THINNEST = 0.004
"""No bone without a role is thinner than this, in heights: long chains of short bones would be hairs."""
HELPER = 0.002
"""Radius of a bone that is no limb, in heights."""
HAIR = 0.7
"""Pixels: the least radius of such a bone."""
SIDES = "-lrh"
"""Letters of the middle, the left, the right, and helpers."""
HELPERS = SIDES.index("h")
THICKEST = 0.42
"""No limb is thicker than this, in its own length: short bones would be balls."""


def radii(body: Character) -> np.ndarray:
    """``(joints, 2)`` metres: of the bone to each joint, at its parent and at itself; 0 for roots.

    What carries the body, and what hangs from there beside it (handles of a rig), has no thickness;
    helpers are thin.
    """
    widths = np.zeros((len(body.roles), 2))
    lengths = body.skeleton.bone_lengths
    top = common_ancestor(body.skeleton, list(body.joint_of.values())) if body.joint_of else 0
    for joint, role in enumerate(body.roles):
        length = float(lengths[joint])
        if length == 0.0 or top not in ancestors(body.skeleton, joint):
            continue
        if joint in helpers(body):
            widths[joint] = HELPER * body.height
            continue
        if role is None or is_tip(role):
            parent = body.skeleton.parents[joint]
            widest = widths[parent, 1] or 0.03 * body.height
            widths[joint] = max(min(PLAIN * length, widest), THINNEST * body.height)
            continue
        trunk = PARTS.get(body_part(role), PARTS["trunk"])
        shares = FINGER if is_finger(role) else LIMBS.get(role.partition("_")[2], trunk)
        widths[joint] = np.multiply(shares, body.height)
        if body_part(role) not in ("trunk", "head"):
            widths[joint] = np.minimum(widths[joint], THICKEST * length)
    return widths


@lru_cache(maxsize=256)
def helpers(body: Character) -> frozenset[int]:
    """Joints that are no limbs of a body with roles: they have no role and no skin, nor has what hangs from
    them (handles, clothes, ends of heads). Of a body without any role all joints are limbs."""
    skinned = np.zeros(len(body.roles)) if body.mesh is None else body.mesh.weights.max(axis=0)
    limbs: set[int] = set()
    for joint, role in enumerate(body.roles):
        if skinned[joint] > 0 or (role is not None and not (is_tip(role) and body_part(role) == "head")):
            limbs.update(ancestors(body.skeleton, joint), (joint,))
    return frozenset(range(len(body.roles))) - limbs if body.joint_of else frozenset()


def heads(body: Character) -> list[tuple[int, int, float]]:
    """Of each head its joint, the joint that says where it points from, and its radius in metres."""
    joint = body.joint_of.get("head")
    if joint is None or body.skeleton.parents[joint] < 0:
        return []
    return [(joint, int(body.skeleton.parents[joint]), HEAD * body.height)]


def sides(body: Character) -> str:
    """One letter per joint: ``l`` or ``r`` for what is on a side, ``h`` for helpers, ``-`` for the rest.

    Joints without roles take the side of what they hang from.
    """
    sides_of: list[str] = []
    for joint, (parent, role) in enumerate(zip(body.skeleton.parents.tolist(), body.roles, strict=True)):
        if joint in helpers(body):
            sides_of.append("h")
        elif role is not None:
            sides_of.append({"left": "l", "right": "r"}.get(role.partition("_")[0], "-"))
        else:
            sides_of.append(sides_of[parent] if parent >= 0 else "-")
    return "".join(sides_of)


LIGHT = np.array([-0.38, 0.84, 0.38])
"""Towards the light, as right, up and towards the eye."""
ROUND = 7
"""Corners of each end of a tube."""
LAYERS = ((0.0, 1.0, 0.80), (0.17, 0.80, 1.0), (0.36, 0.46, 1.22))
"""Shading of a tube, by layer: shift towards the light, width (shares of its radius), brightness."""
FINE = 2.5
"""Pixels: thinner tubes are not shaded."""
OUTLINE = 0.45
"""Brightness of the rim of a tube."""
RIM = 1.5
"""Pixels."""
FARTHEST = 20.0
"""Pieces that reach farther than so many times the picture's size from it are left out."""
LEVELS = 24
"""Shades of a skin, and of points by their distance."""
DOT = 0.0035
"""Radius of a point, in heights."""
OFF, DARK = 0.01, 0.35
"""Heights that points stand off a skin that they are drawn on, and their shade there."""
DIAMOND = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


@dataclass(frozen=True)
class Piece:
    """A polygon: the farther from the eye (metres), the earlier it is drawn."""

    depth: float
    corners: list[float]
    colour: Colour


@dataclass(frozen=True, eq=False)
class Solid:
    """A figure with positions, ready to be drawn in a colour; its left is lighter and its right darker.

    skin: with its skin, where it has one and its rotations are known. thick: how thick bones are; usual: 1.
    groups: ``(joints,)`` numbers of ``group_colours`` for the bones to joints, in place of sides.
    """

    figure: Figure
    colour: Colour
    skin: bool = False
    thick: float = 1.0
    groups: np.ndarray | None = None
    group_colours: tuple[Colour, ...] = ()

    @property
    def places(self) -> np.ndarray:
        """``(frames, joints, 3)`` metres."""
        assert self.figure.positions is not None
        return self.figure.positions

    @property
    def body(self) -> Character:
        return self.figure.character

    @property
    def size(self) -> float:
        """Metres: the body's height, or how far it reaches where it has none."""
        height = self.body.height
        if np.isfinite(height) and height > 0:
            return float(height)
        return max(float(np.ptp(self.extent, axis=1).max()), 0.1)

    @cached_property
    def extent(self) -> np.ndarray:
        """``(frames, n, 3)`` metres that have to be in the picture: limbs, or a box around points."""
        points = self.figure.points
        if points is None or len(self.body.skeleton) > 1:
            limbs = [joint for joint in range(len(self.body.roles)) if joint not in helpers(self.body)]
            return self.places[:, limbs]
        ends = np.array([[each.min(axis=0), each.max(axis=0)] for each in points])
        corners = [ends[:, [i, j, k], [0, 1, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
        return np.stack(corners, axis=1)

    @cached_property
    def skinned(self) -> bool:
        """True where a skin is drawn, not bones."""
        return self.skin and self.figure.has_skin

    @cached_property
    def _bones(self) -> tuple[np.ndarray, np.ndarray]:
        """Joints ``(bones, 2)``, the upper one first, and radii ``(bones, 2)`` metres."""
        sizes = self.thick * np.nan_to_num(radii(self.body))
        lower = np.flatnonzero(sizes.any(axis=1))
        return np.stack([self.figure.parents[lower], lower], axis=1), sizes[lower]

    @cached_property
    def _sides(self) -> np.ndarray:
        """``(joints,)`` 0 for the middle, 1 for the left, 2 for the right, 3 for helpers; or the groups."""
        if self.groups is not None:
            return self.groups
        return np.array([SIDES.index(letter) for letter in sides(self.body)])

    def bones(self, frame: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tubes at a frame, heads included: ends ``(n, 2, 3)``, radii ``(n, 2)``, sides ``(n,)``."""
        places = self.places[frame]
        pairs, radii = self._bones
        ends, sides = places[pairs], self._sides[pairs[:, 1]]
        for joint, below, size in heads(self.body):
            radius = self.thick * size
            way = places[joint] - places[below]
            way = way / max(float(np.linalg.norm(way)), 1e-9) * radius
            ball = np.stack([places[joint] + 0.75 * way, places[joint] + 1.35 * way])
            ends = np.concatenate([ends, ball[None]])
            radii = np.concatenate([radii, [[radius, 0.92 * radius]]])
            sides = np.append(sides, self._sides[joint])
        if not len(ends):  # a body of one joint, or without any length
            ball = np.repeat(places[:1], 2, axis=0)
            return ball[None], np.full((1, 2), 0.03 * self.size), np.zeros(1, dtype=int)
        return ends, radii, sides

    def pieces(self, frame: int, camera: Camera, target: np.ndarray, size: tuple[int, int]) -> list[Piece]:
        """The polygons of a frame, in no order. size: of the picture, pixels."""
        limit = FARTHEST * max(size)
        dotted = self.skin and self.figure.points is not None
        dots = list(self._dots(frame, camera, target, limit)) if dotted else []
        if dotted and not self.skinned:
            return dots
        draw = self._skinned if self.skinned else self._tubes
        return [*draw(frame, camera, target, limit), *dots]

    def lit_pieces(
        self, frame: int, camera: Camera, target: np.ndarray, size: tuple[int, int]
    ) -> list[Piece]:
        """The faces of a skin that are inside the body, to be drawn over all others."""
        mesh = self.body.mesh
        if mesh is None or not (self.skinned and self.figure.testable):
            return []
        lit = self.figure.inside_at(frame)[mesh.faces].any(axis=1)
        return (
            list(self._faces(frame, camera, target, FARTHEST * max(size), lit, [LIT])) if lit.any() else []
        )

    def _dots(self, frame: int, camera: Camera, target: np.ndarray, limit: float) -> Iterator[Piece]:
        """Points, the near ones darker; on a skin, dark in front of it and hidden behind it."""
        assert self.figure.points is not None
        pixels, depths, scales = camera.project(self.figure.points[frame], target)
        good = np.isfinite(pixels).all(axis=1) & (np.abs(pixels).max(axis=1) < limit)
        near = (depths.max() - depths) / max(float(np.ptp(depths)), 1e-9)
        levels = np.rint(LEVELS * near).astype(int)
        shades = [shade(self.colour, 1.7 - 0.9 * k / LEVELS) for k in range(LEVELS + 1)]
        if self.skinned:
            shades, depths = [shade(self.colour, DARK)] * len(shades), depths - OFF * self.size
        radius = np.maximum(DOT * self.size * scales, 1.0)
        corners = pixels[:, None] + radius[:, None, None] * DIAMOND
        for point in np.flatnonzero(good).tolist():
            yield Piece(float(depths[point]), corners[point].ravel().tolist(), shades[levels[point]])

    def _tubes(self, frame: int, camera: Camera, target: np.ndarray, limit: float) -> Iterator[Piece]:
        ends, radii, sides = self.bones(frame)
        pixels, depths, scales = camera.project(ends, target)
        wide = radii * scales
        depth = depths.mean(axis=1)
        good = np.isfinite(pixels).all(axis=(1, 2)) & (np.abs(pixels).max(axis=(1, 2)) < limit)
        good &= wide.max(axis=1) < limit
        rims = tube(pixels, wide + RIM)
        layers = [tube(pixels + _shift(wide, shift), share * wide) for shift, share, _ in LAYERS]
        colours = self.group_colours or tints(self.colour)
        for bone in np.flatnonzero(good).tolist():
            if self.groups is None and sides[bone] == HELPERS:
                line = tube(pixels[bone : bone + 1], np.maximum(wide[bone : bone + 1], HAIR))
                yield Piece(depth[bone], line.ravel().tolist(), GRID)
                continue
            colour = colours[sides[bone]]
            yield Piece(depth[bone], rims[bone].ravel().tolist(), shade(colour, OUTLINE))
            count = len(LAYERS) if wide[bone].max() > FINE else 1
            for layer, (_, _, bright) in list(zip(layers, LAYERS, strict=True))[:count]:
                yield Piece(depth[bone], layer[bone].ravel().tolist(), shade(colour, bright))

    @cached_property
    def face_sides(self) -> np.ndarray:
        """``(faces,)`` sides of a skin's faces: those of the joints that their corners follow most."""
        mesh = self.body.mesh
        assert mesh is not None
        return self._sides[mesh.weights.argmax(axis=1)][mesh.faces[:, 0]]

    def skin_at(self, frame: int) -> np.ndarray:
        """``(vertices, 3)`` metres of the skin at a frame."""
        vertices: np.ndarray = self.figure.skin_at(slice(frame, frame + 1))[0]
        return vertices

    def _skinned(self, frame: int, camera: Camera, target: np.ndarray, limit: float) -> Iterator[Piece]:
        every = np.ones(len(self.face_sides), dtype=bool)
        return self._faces(frame, camera, target, limit, every, tints(self.colour))

    def _faces(
        self,
        frame: int,
        camera: Camera,
        target: np.ndarray,
        limit: float,
        chosen: np.ndarray,
        colours: Sequence[Colour],
    ) -> Iterator[Piece]:
        """Chosen faces of the skin ``(faces,)`` that look towards the eye. colours: one, or by side."""
        assert self.body.mesh is not None
        corners = self.skin_at(frame)[self.body.mesh.faces[chosen]]  # (faces, 3, 3)
        sides = np.minimum(self.face_sides[chosen], len(colours) - 1)
        pixels, depths, _ = camera.project(corners, target)
        first, second = pixels[:, 1] - pixels[:, 0], pixels[:, 2] - pixels[:, 0]
        toward = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0  # rows of pixels run down
        toward &= np.isfinite(pixels).all(axis=(1, 2)) & (np.abs(pixels).max(axis=(1, 2)) < limit)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        lit = normal @ (camera.axes * np.array([[1.0], [1.0], [-1.0]])).T @ LIGHT
        levels = np.rint(LEVELS * np.clip(lit, 0.0, 1.0)).astype(int)
        shades = [[shade(tint, 0.5 + 0.75 * k / LEVELS) for k in range(LEVELS + 1)] for tint in colours]
        flat, depth = pixels.reshape(len(pixels), -1), depths.mean(axis=1)
        for face in np.flatnonzero(toward).tolist():
            colour = shades[sides[face]][levels[face]]
            yield Piece(depth[face], flat[face].tolist(), colour)


def tube(ends: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """``(n, 2 * ROUND, 2)`` corners of the outline around two discs each: middles ``(n, 2, 2)``, radii
    ``(n, 2)``, pixels. Where one disc holds the other, the outline is that of the larger one."""
    way = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)
    along = np.arctan2(way[:, 1], way[:, 0])
    lean = np.arccos(np.clip((radii[:, 0] - radii[:, 1]) / length, -1.0, 1.0))
    steps = np.linspace(0.0, 1.0, ROUND)
    upper = (along + lean)[:, None] + steps * (2 * np.pi - 2 * lean)[:, None]
    lower = (along - lean)[:, None] + steps * (2 * lean)[:, None]
    turns = np.stack([upper, lower], axis=1)
    arcs = np.stack([np.cos(turns), np.sin(turns)], axis=-1) * radii[..., None, None]
    return (ends[:, :, None] + arcs).reshape(len(ends), 2 * ROUND, 2)


def _shift(radii: np.ndarray, share: float) -> np.ndarray:
    """``(n, 2, 2)`` pixels towards the light, by a share of the radii ``(n, 2)``."""
    way = LIGHT[:2] * np.array([1.0, -1.0]) / np.linalg.norm(LIGHT[:2])
    return share * radii[..., None] * way
