"""Training data of feature networks: the training motion of a data set, per structure.

A structure that a data set keeps out of training as a whole has no motion of its own here. Its network is
trained on motion of another structure, seen at those joints that lie where its own joints lie: the joints
of both are matched by their places in the reference pose, between the two bodies that are most alike.
Places, not roles, since what a role names (the head, the upper spine) lies elsewhere on another structure.

The network of all bodies on two legs sees the motion of every such structure, at the joints that they share
by role.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from retarget_bench.api import TWO_LEGS, Dataset, TrainingClips
from retarget_bench.api.comparison import structure_joints
from retarget_bench.api.datasets import Cast
from retarget_bench.errors import NotSupported, Unusable
from retarget_bench.motion import kinematics
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import ESSENTIAL
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.clips import Progress, by_character, training_clips
from retarget_bench.training.features import network, windows

NEAR = 0.06
"""Heights by which matched joints may lie apart, at most."""
Clips = Mapping[str, np.ndarray]
"""``character/clip`` -> ``(frames, channels)`` float32."""


@dataclass(frozen=True)
class Source:
    """Origin of the motion for a structure's network.

    structure: or ``TWO_LEGS``; then lender is the same, and every body's joints of these roles are seen.
    lender: the structure that moves. joints: which of its joints are seen, in the structure's own order.
    roles:  of the structure's own joints.
    """

    structure: str
    lender: str
    joints: tuple[int, ...]
    roles: tuple[str | None, ...]

    @property
    def borrowed(self) -> bool:
        return self.lender != self.structure

    @property
    def design(self) -> network.Design:
        return network.design_of(self.structure)


_TWO_LEGS = Source(TWO_LEGS, TWO_LEGS, (), ESSENTIAL)


def performers(data: Dataset, source: Source) -> dict[str, TrainingClips]:
    """Character -> the clips that a network is trained on, in a fixed order."""
    moving = training_clips(data)
    if source.structure != TWO_LEGS:
        return dict(sorted(moving[source.lender].items()))
    cast = data.characters()
    everybody = {name: clips for characters in moving.values() for name, clips in characters.items()}
    return {name: everybody[name] for name in sorted(everybody) if not network.stranger(cast[name])}


def sources(data: Dataset, structures: Sequence[str] = ()) -> list[Source]:
    """Origin of the motion per structure and, as one, for all bodies on two legs; without ``structures``
    for all that some motion fits.

    Raises NotSupported where the data set has no training motion, or none for a structure asked for.
    """
    moving = training_clips(data)
    cast: dict[str, list[Character]] = {}
    for character in data.characters().values():
        if not windows.unseeable(character):
            cast.setdefault(character.structure, []).append(character)
    two_legs = [TWO_LEGS] if performers(data, _TWO_LEGS) else []
    available = [*cast, *two_legs]
    if unknown := [name for name in structures if name not in available]:
        raise NotSupported(
            f"{data.label} has no structure {unknown[0]!r} with a facing; structures are "
            f"{', '.join(available)}"
        )
    sources = [
        _TWO_LEGS if name == TWO_LEGS else _source(name, cast, moving) for name in structures or available
    ]
    if structures and None in sources:
        raise NotSupported(
            f"{data.label} has no training motion of structure {structures[sources.index(None)]!r}, nor "
            "of one that has a joint wherever it has one"
        )
    return [each for each in sources if each is not None]


def gather(spec: Spec, source: Source, jobs: int, progress: Progress) -> dict[str, np.ndarray]:
    """The clips of all training characters, in a fixed order, as channels."""
    names = list(performers(bound.dataset(spec).built, source))
    common = {"dataset": spec, "source": source}
    results = by_character(clips_of, names, common, jobs, progress)
    return {name: clip for clips in results.values() for name, clip in clips.items()}


def clips_of(job: Mapping[str, Any]) -> Clips:
    """The clips of one character that are long enough, as channels; what a worker process does."""
    registry.know_files(job["plugins"])
    source, character = job["source"], job["character"]
    clips = performers(bound.dataset(job["dataset"]).built, source)[character]
    by_clip = {}
    for number in range(len(clips)):
        try:
            motion = clips[number]
            joints = source.joints or motion.character.joints(source.roles)
            channels = windows.channels(motion, joints)
        except Unusable:
            continue
        if len(channels) >= source.design.frames:
            by_clip[f"{character}/{clips.names[number]}"] = channels.astype(np.float32)
    return by_clip


def _source(structure: str, cast: Mapping[str, Sequence[Character]], moving: Cast) -> Source | None:
    body = cast[structure][0]
    own = structure_joints(body).tolist()
    roles = tuple(body.roles[joint] for joint in own)
    if structure in moving:
        return Source(structure, structure, tuple(own), roles)
    offers = []
    for lender in moving:
        if lender in cast:
            apart, joints = min(
                (_match(a, b) for a in cast[structure] for b in cast[lender] if b.name in moving[lender]),
                key=lambda offer: offer[0],
                default=(np.inf, ()),
            )
            offers.append((apart, lender, joints))
    apart, lender, joints = min(offers, default=(np.inf, "", ()))
    return Source(structure, lender, joints, roles) if apart < NEAR else None


def _match(body: Character, lender: Character) -> tuple[float, tuple[int, ...]]:
    """Heights by which matched joints lie apart at most, and the lender's joint for each of the body's."""
    from scipy.optimize import linear_sum_assignment  # type: ignore[import-untyped]

    places, lender_places = _places(body), _places(lender)
    if len(places) > len(lender_places):
        return np.inf, ()
    apart = np.linalg.norm(places[:, None] - lender_places, axis=-1)
    rows, columns = linear_sum_assignment(apart**2)
    return float(apart[rows, columns].max()), tuple(structure_joints(lender)[columns].tolist())


def _places(body: Character) -> np.ndarray:
    """``(joints seen, 3)`` places in the reference pose, hips at zero, in heights."""
    places, _ = kinematics.forward(body.skeleton, body.reference_pose, np.zeros(3))
    hips = places[body.joint_of.get("hips", 0)]
    return np.asarray((places[structure_joints(body)] - hips) / body.height)
