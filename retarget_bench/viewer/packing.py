"""Compact encoding of scenes for pages: quantised, delta-coded, deflated.

A scene is one JSON object. What people read (labels, messages, values) is in it as text; all series are in
``data``: whole numbers, the second differences over frames of every coordinate, joint by joint, as
integers of variable length (seven bits a byte, low bits first, the sign in the lowest bit), all deflated
together and in base64. ``pages/player/packed.js`` is the reader. Skins, where they are asked for, come
last; ``pages/player/skins.js`` reads them.
"""

import base64
import math
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from retarget_bench.api import Ground
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character
from retarget_bench.viewer import bodies
from retarget_bench.viewer.colours import names
from retarget_bench.viewer.scene import Figure, Scene
from retarget_bench.viewer.skins import Skin

SCHEMA = 1
STEP = 5e-4
"""Metres. A joint is at most sqrt(3) / 2 of it, 0.433 mm, from where it was."""
ERROR_STEP = 0.01
"""Of errors, in % of height."""
FARTHEST = 1e6
"""Metres: what is farther from the origin is shown here."""
SKIN_STEP, TURN_STEP = 2.5e-4, 2.0**-11
"""Of skins, metres; of the quaternions that they are turned by."""
SURFACE_STEP = 2e-3
"""Metres, of vertices that move by no skeleton."""
_BITS = 7


def packed(scene: Scene, triangles: int = 0) -> dict[str, Any]:
    """A scene as one object of plain values, for ``json.dumps`` and the player.

    Bodies that figures share are written once. Colours are the palette's: source, reference, then the
    others in their order. triangles: of the mesh of a body that has one, at most, for figures with known
    rotations; 0 leaves meshes out.
    Raises BenchError where positions or skins are not finite.
    """
    bodies: list[Character] = []
    figures: list[dict[str, Any]] = []
    for figure, colour in zip(scene.figures, names(scene), strict=True):
        head = _head(figure, scene.values.get(figure.label, {}))
        figures.append(head | {"body": _index(bodies, figure.character), "colour": colour})
    worn = _worn(bodies, figures, triangles) if triangles else {}
    for each in figures:
        each["skin"] = each["skin"] and each["body"] in worn
    worn_by = [worn.get(each["body"]) if each["skin"] else None for each in figures]
    for each, figure, skin in zip(figures, scene.figures, worn_by, strict=True):
        if skin is not None and figure.surface is not None:
            each["surface"] = True
    series = b"".join(_integers(each) for each in _series(scene, worn_by))
    series += b"".join(_integers(each) for place in worn for each in _skin(bodies[place], worn[place]))
    return {
        "schema": SCHEMA,
        "title": scene.title,
        "case": scene.case,
        "split": scene.split,
        "kind": scene.kind,
        "fps": float(scene.fps),
        "frames": scene.frames,
        "step": STEP,
        "errorStep": ERROR_STEP,
        "skinStep": SKIN_STEP,
        "turnStep": TURN_STEP,
        "surfaceStep": SURFACE_STEP,
        "ground": _ground(scene.ground),
        "bodies": [_body(each, worn.get(place)) for place, each in enumerate(bodies)],
        "figures": figures,
        "data": base64.b64encode(zlib.compress(series, 9)).decode("ascii"),
    }


def inside_at(figure: Figure, frame: int, triangles: int) -> list[int]:
    """Corners of a figure's packed skin that are inside its body at a frame (``Figure.inside_at``)."""
    if not figure.testable or figure.character.mesh is None:
        return []
    lit = Skin.of(figure.character.mesh, triangles).any(figure.inside_at(frame)[None])[0]
    return np.flatnonzero(lit).tolist()


def _worn(bodies: list[Character], figures: list[dict[str, Any]], triangles: int) -> dict[int, Skin]:
    """Place of a body -> its skin, of those that have one and that somebody moves in."""
    moved = sorted({each["body"] for each in figures if each["skin"]})
    meshes = {place: bodies[place].mesh for place in moved}
    return {
        place: Skin.of(mesh, triangles)
        for place, mesh in meshes.items()
        if mesh is not None and len(mesh.faces)
    }


def _index(bodies: list[Character], body: Character) -> int:
    """The place of a body in the list, to which it is added where it is new."""
    for place, other in enumerate(bodies):
        if body is other or (body.name == other.name and body.skeleton.same_as(other.skeleton)):
            return place
    bodies.append(body)
    return len(bodies) - 1


def _body(body: Character, skin: Skin | None) -> dict[str, Any]:
    packed: dict[str, Any] = {
        "name": body.name,
        "height": round(float(body.height), 4),
        "joints": list(body.skeleton.names),
        "parents": body.skeleton.parents.tolist(),
        "radii": np.rint(1000.0 * bodies.radii(body)).astype(int).ravel().tolist(),
        "heads": [[joint, below, round(1000.0 * radius)] for joint, below, radius in bodies.heads(body)],
        "sides": bodies.sides(body),
    }
    if skin is not None:
        vertices, faces = len(skin.mesh.vertices), len(skin.mesh.faces)
        packed["skin"] = {"vertices": vertices, "faces": faces, "joints": skin.joints.tolist()}
    return packed


def _head(figure: Figure, values: dict[str, float]) -> dict[str, Any]:
    """A figure apart from its series, and which of these it has."""
    shown = figure.positions is not None
    return {
        "label": figure.label,
        "part": figure.part,
        "status": figure.status,
        "message": figure.message,
        "shown": shown,
        "contacts": list(figure.joints) if shown and figure.joints and figure.planted is not None else None,
        "error": shown and figure.error is not None,
        "skin": shown and figure.has_skin and _fits(figure),
        "values": {name: float(value) for name, value in values.items() if math.isfinite(value)},
    }


def _fits(figure: Figure) -> bool:
    """True where a skin can follow: rotations are of the body's own joints."""
    return figure.motion is None or len(figure.motion.skeleton) == len(figure.parents)


def _ground(ground: Ground) -> dict[str, Any]:
    if ground.heights is None:
        return {"height": float(ground.height)}
    rows, columns = map(int, ground.heights.shape)
    origin, spacing = [float(each) for each in ground.origin], float(ground.spacing)
    field = {"rows": rows, "columns": columns, "origin": origin, "spacing": spacing}
    return {"height": float(ground.height), **field}


def _skin(body: Character, skin: Skin) -> Iterator[np.ndarray]:
    """Corners and joints of the mesh's own pose, faces, joints by falling share, and all shares but the
    first of each corner."""
    places, _ = skin.mesh.bound(body.skeleton)
    yield _changes(_steps(skin.mesh.vertices, SKIN_STEP).T)
    yield _changes(_steps(places[skin.joints], SKIN_STEP).T)
    yield skin.back()
    yield skin.followed.T
    yield skin.shares[:, 1:].T


def _series(scene: Scene, skins: list[Skin | None]) -> Iterator[np.ndarray]:
    """Whole numbers, per figure ``(joints * 3, frames)``, contacts, error, turns; last the floor's rows."""
    for figure, skin in zip(scene.figures, skins, strict=True):
        if figure.positions is None:
            continue
        if not np.isfinite(figure.positions).all():
            raise BenchError(f"{scene.title}: {figure.label} has positions that are not finite")
        yield _changes(_steps(figure.positions, STEP).reshape(scene.frames, -1).T)
        if figure.joints and figure.planted is not None:
            yield _changes(figure.planted.astype(np.int64).T)
        if figure.error is not None:
            error = np.where(np.isfinite(figure.error), figure.error, -ERROR_STEP)
            yield _changes(_steps(error, ERROR_STEP)[None])
        if skin is not None and figure.surface is not None:
            if not np.isfinite(figure.surface).all():
                raise BenchError(f"{scene.title}: {figure.label} has vertices that are not finite")
            corners = skin.middles(figure.surface)
            yield _changes(_steps(corners, SURFACE_STEP).reshape(scene.frames, -1).T)
        elif skin is not None and figure.motion is not None:
            yield _changes(_steps(skin.turns(figure.motion), TURN_STEP).reshape(scene.frames, -1).T)
    if scene.ground.heights is not None:
        yield _changes(_steps(scene.ground.heights, STEP))


def _steps(values: np.ndarray, step: float) -> np.ndarray:
    return np.rint(np.clip(values, -FARTHEST, FARTHEST) / step).astype(np.int64)


def _changes(rows: np.ndarray) -> np.ndarray:
    """Second differences along rows, as though two zeros stood before each."""
    return np.diff(np.diff(rows, axis=1, prepend=0), axis=1, prepend=0)


def _integers(values: np.ndarray) -> bytes:
    """Whole numbers of any shape as variable-length integers."""
    flat = values.ravel()
    rest = np.where(flat >= 0, 2 * flat, -2 * flat - 1)
    columns, more = [], np.ones(len(rest), dtype=bool)
    present = []
    while more.any():
        present.append(more)
        low, rest = rest & 0x7F, rest >> _BITS
        more = more & (rest > 0)
        columns.append(np.where(more, low | 0x80, low))
    if not columns:
        return b""
    return np.stack(columns, axis=1)[np.stack(present, axis=1)].astype(np.uint8).tobytes()
