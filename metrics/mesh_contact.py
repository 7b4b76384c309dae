"""Contacts of the skin: hands on the body, soles on the ground, anything below it.

Of no plain run of the main task: it takes some 90 ms a clip of three seconds, beside the skinning, and all
values of joints together 2 to 7. ``bench run --metrics mesh_contact`` computes it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from weakref import WeakKeyDictionary

import numpy as np

from retarget_bench.api import Metric, MetricCard, Prediction, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.motion.character import Character
from retarget_bench.motion.ground import ground_height
from retarget_bench.motion.penetration.distances import to_surface, within
from retarget_bench.motion.penetration.limbs import moved_vertices
from retarget_bench.motion.roles import HANDS, LIMB_ROLES

NEAR = 0.01
"""Heights: skin that is no farther from other skin touches it, as touching points of ``touch`` do."""
HELD = 2 * NEAR
"""Heights: up to this distance a contact counts as kept, or as found rightly: none is lost by a hair."""
RATE = 10.0
"""Frames per second that hands are looked at; grounds are looked at in every frame."""
LIMIT = 0.01
"""Metres: depths up to this are no fault."""

Patches = Mapping[tuple[str, int], np.ndarray]
"""Hand and frame -> ``(n, 3)`` the triangles of the body that the hand is near, of those with any."""

TOUCH = (
    "surfaces: a hand's skin (vertices and middles of faces and edges) and the triangles of the body "
    f"without that arm; touching: at most {NEAR:g} h apart; frames: {RATE:g} per second; pooled over hands"
)
PLACE = (
    "gap: least distance of the prediction's hand from the triangles that the reference's hand touches in "
    "that frame, where they are on the prediction's body; over the frames and hands in which "
    f"the reference touches; left out where it never does; {TOUCH}"
)
DEPTH = "depth: how far the lowest vertex of the body is below the ground under it, 0 where none is"
GAP = (
    "gap: height over the ground of the lowest vertex of a foot (fore paws of dogs too; vertices that foot "
    "and toes move for the most part), 0 where it is below; pooled over feet and the frames in which a "
    "contact joint of the foot is labelled planted (labels as contact_recall.speed); left out where "
    "there is none"
)
PROJECT = "the project's definition: touch, penetration and floating of joints, measured on the skin"

_value = partial(Value, better="lower", source=PROJECT, needs=("mesh",), tolerance=1e-2)
_contact = partial(_value, needs=("reference", "mesh"))


class MeshContact(Metric):
    """Contacts between surfaces. The ground is the case's, flat at 0 where the data set says nothing."""

    card = MetricCard(
        name="mesh_contact",
        summary="contacts of the skin: hands on the body, soles on the ground",
        version="1",
        tasks=("points",),
        values=(
            _contact(
                "mesh_contact_gap_h",
                "mesh self-contact error",
                "mean distance of the hand's skin from the skin that the reference's hand touches",
                "% of height",
                formula=f"100 * mean of gap / h; {PLACE}",
            ),
            _contact(
                "mesh_contact_recall",
                "mesh self-contact recall",
                "share of the reference's contacts of hand and body that are kept, at the same place",
                "1",
                better="higher",
                formula=f"share of frames and hands with gap <= {HELD:g} h; {PLACE}",
            ),
            _contact(
                "mesh_contact_precision",
                "mesh self-contact precision",
                "share of the contacts of hand and body found that the reference has too",
                "1",
                better="higher",
                formula="share of the frames and hands in which the prediction touches its body anywhere, "
                f"in which the reference is at most {HELD:g} h from doing so; left out where it never "
                f"touches; {TOUCH}",
            ),
            _value(
                "mesh_ground_penetration.rate",
                "mesh ground penetration rate",
                "share of frames in which the skin is more than a centimetre below the ground",
                "% of frames",
                formula=f"100 * frames with depth > 1 cm / frames; {DEPTH}",
            ),
            _value(
                "mesh_ground_penetration.mean_h",
                "mesh ground penetration",
                "depth of the skin below the ground, mean over all frames",
                "% of height",
                formula=f"100 * mean over frames of depth / h; {DEPTH}",
            ),
            _value(
                "mesh_floating.mean_h",
                "floating of soles",
                "height of the sole over the ground while the foot should stand, mean",
                "% of height",
                formula=f"100 * mean of gap / h; {GAP}",
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out where vertices are not known; of contacts, without roles of hands, feet or arms."""
        if comparison.predicted_vertices is None:
            return {}
        values = _touches(comparison) | _depths(comparison)
        gaps = _floating(comparison)
        if gaps.size:
            values["mesh_floating.mean_h"] = 100.0 * float(gaps.mean()) / comparison.height
        return values


# ---------------------------------------------------------------------------------------------- ground
def _above_ground(comparison: Comparison, vertices: np.ndarray) -> np.ndarray:
    """``(frames, V)`` metres of vertices ``(frames, V, 3)`` over the ground under them."""
    floor = ground_height(comparison.case.ground, vertices[..., 0], vertices[..., 2])
    return np.asarray(vertices[..., 1] - floor)


def _depths(comparison: Comparison) -> dict[str, float]:
    vertices = comparison.predicted_vertices
    assert vertices is not None
    depth = np.maximum(-_above_ground(comparison, vertices).min(axis=1), 0.0)
    return {
        "mesh_ground_penetration.rate": 100.0 * float((depth > LIMIT).mean()),
        "mesh_ground_penetration.mean_h": 100.0 * float(depth.mean()) / comparison.height,
    }


def _floating(comparison: Comparison) -> np.ndarray:
    """``(n,)`` metres: heights over the ground of all feet, in the frames in which they should stand."""
    vertices, labels, body = comparison.predicted_vertices, comparison.contact_labels, comparison.target
    heights = [np.zeros(0)]
    if labels is None or vertices is None or body.mesh is None:
        return heights[0]
    for top, joints in _feet(body, comparison.contact_roles).items():
        stands = labels.planted[:, np.isin(labels.joints, joints)].any(axis=1)
        sole = moved_vertices(body.mesh, body.skeleton, top)
        if stands.any() and sole.any():
            heights.append(_above_ground(comparison, vertices[stands][:, sole]).min(axis=1))
    return np.maximum(np.concatenate(heights), 0.0)


def _feet(body: Character, roles: Sequence[str]) -> dict[int, list[int]]:
    """The uppermost contact joint of each limb -> all contact joints of that limb."""
    limbs = [[body.joint_of[role] for role in chain if role in roles] for chain in LIMB_ROLES.values()]
    return {joints[0]: joints for joints in limbs if joints}


# --------------------------------------------------------------------------------------------- touching
@dataclass(frozen=True, eq=False)
class Hand:
    """A hand and the body that it may touch.

    name: its role. samples: ``(n, 6)`` vertex numbers whose means are points of its skin.
    faces: ``(F, 3)`` the body without the arm.
    """

    name: str
    samples: np.ndarray
    faces: np.ndarray

    def points(self, vertices: np.ndarray) -> np.ndarray:
        """``(n, 3)`` metres, of the body's vertices ``(V, 3)``."""
        return np.asarray(vertices[self.samples].mean(axis=1))


@lru_cache(maxsize=256)
def hands(body: Character) -> tuple[Hand, ...]:
    """The hands of a body with a mesh; fore paws are none."""
    mesh, hands = body.mesh, []
    for role in HANDS if mesh is not None and not body.four_legged else ():
        assert mesh is not None
        arm = body.joint_of.get(role.replace("hand", "arm"))
        if arm is None or role not in body.joint_of:
            continue
        own = moved_vertices(mesh, body.skeleton, body.joint_of[role])
        skin = mesh.faces[own[mesh.faces].all(axis=1)]
        rest = mesh.faces[~moved_vertices(mesh, body.skeleton, arm)[mesh.faces].any(axis=1)]
        if len(skin) and len(rest):
            hands.append(Hand(role, _samples(skin), rest))
    return tuple(hands)


def _samples(faces: np.ndarray) -> np.ndarray:
    """``(n, 6)`` vertex numbers, each once, whose means are the vertices and the middles of the edges and
    faces of ``(F, 3)``."""
    vertices = np.unique(faces)
    edges = np.unique(
        np.sort(np.concatenate([faces[:, k] for k in ([0, 1], [1, 2], [2, 0])]), axis=1), axis=0
    )
    return np.concatenate([np.repeat(vertices[:, None], 6, axis=1), np.tile(edges, 3), np.tile(faces, 2)])


def _touches(comparison: Comparison) -> dict[str, float]:
    """Values of self-contact; empty without a reference, or without hands."""
    expected = _reference_contacts(comparison)
    if expected is None:
        return {}
    predicted, values = comparison.predicted_vertices, {}
    assert predicted is not None
    predicted = predicted[:: _step(comparison)]
    by_name = {hand.name: hand for hand in hands(comparison.target)}
    gaps = np.array(
        [
            to_surface(by_name[name].points(vertices), vertices, triangles).min()
            for (name, frame), triangles in expected[0].items()
            for vertices in (predicted[frame],)
        ]
    )
    if gaps.size:
        values["mesh_contact_gap_h"] = 100.0 * float(gaps.mean()) / comparison.height
        values["mesh_contact_recall"] = float((gaps <= HELD * comparison.height).mean())
    contacts = patches(comparison.target, predicted, NEAR * comparison.height)
    if contacts:
        values["mesh_contact_precision"] = sum(each in expected[1] for each in contacts) / len(contacts)
    return values


def patches(body: Character, vertices: np.ndarray, limit: float) -> Patches:
    """Triangles that hands touch during a motion of its vertices ``(frames, V, 3)``.

    limit: metres, the distance up to which they do.
    """
    contacts = {}
    for hand in hands(body):
        for frame, places in enumerate(vertices):
            points = hand.points(places)
            corners = places[hand.faces]
            # only triangles whose box is near the hand's can touch it
            near = (corners.min(axis=1) <= points.max(axis=0) + limit).all(axis=1)
            near &= (corners.max(axis=1) >= points.min(axis=0) - limit).all(axis=1)
            _, triangle, metres = within(points, corners[near], limit)
            touched = np.unique(triangle[metres <= limit])
            if len(touched):
                contacts[hand.name, frame] = hand.faces[near][touched]
    return contacts


_cache: WeakKeyDictionary[Prediction, tuple[Patches, Patches]] = WeakKeyDictionary()
"""Contacts of references, which all methods are compared with."""


def _reference_contacts(comparison: Comparison) -> tuple[Patches, Patches] | None:
    """Contacts of the reference, and those with what is nearly one; None without a reference."""
    reference = comparison.case.reference
    if reference is None or comparison.expected_vertices is None:
        return None
    if (cached := _cache.get(reference)) is None:
        vertices = comparison.expected_vertices[:: _step(comparison)]
        near, held = (patches(comparison.target, vertices, x * comparison.height) for x in (NEAR, HELD))
        cached = _cache[reference] = near, held
    return cached


def _step(comparison: Comparison) -> int:
    return max(round(comparison.fps / RATE), 1)


plugin = MeshContact
