"""Asking one method all probes on a few cases of a data set, or on two BVH files."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from retarget_bench.api import Case, CaseInfo, Context, Method, Prediction, Source
from retarget_bench.api.optional import method_card
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.predict import Outcome, predict
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, kind_of
from retarget_bench.results import store
from retarget_bench.verification.probe.probes import PROBES, Probe, ProbeCase, deviation

FEWEST = 4
"""Motions without which a correlation says nothing."""
_STILL = 1e-9

Bones = Sequence[tuple[str, str]]
"""Roles of the two ends of lines on a body."""


def pose_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance of directions ``(frames, bones, 3)``, over the frames that both have: 0 to 2."""
    frames = min(len(a), len(b))
    return float(np.linalg.norm(a[:frames] - b[:frames], axis=-1).mean())


def poses(motion: Prediction, bones: Bones) -> np.ndarray:
    """``(frames, bones, 3)`` unit vectors along the bones, turned so that the hips face one way."""
    joint, places = motion.character.joint_of, motion.positions
    lines = np.stack([places[:, joint[end]] - places[:, joint[start]] for start, end in bones], axis=1)
    lines /= np.maximum(np.linalg.norm(lines, axis=-1, keepdims=True), _STILL)
    if not {"left_up_leg", "right_up_leg"} <= joint.keys():
        return lines
    across = places[:, joint["left_up_leg"]] - places[:, joint["right_up_leg"]]
    # the hips face across x up = (-across z, 0, across x)
    yaw = np.arctan2(-across[:, 2], across[:, 0])
    return rotation.rotate(rotation.about(np.array([0.0, 1.0, 0.0]), -yaw[:, None]), lines)


def shared_bones(characters: Sequence[Character]) -> Bones:
    """Lines between joints whose roles all bodies have: from each to the next one above it in the first."""
    first = characters[0]
    shared = {role for role in first.joint_of if all(role in each.joint_of for each in characters)}
    bones = []
    for role in sorted(shared):
        above = int(first.skeleton.parents[first.joint_of[role]])
        while above >= 0 and first.roles[above] not in shared:
            above = int(first.skeleton.parents[above])
        if above >= 0:
            bones.append((str(first.roles[above]), role))
    return bones


def dependence(sources: Sequence[Prediction], answers: Sequence[Prediction]) -> dict[str, float]:
    """Dependence of the answers of one target on their sources.

    A faithful method keeps distances: its answers are as like each other as their sources are. Answers of a
    method that does not look at its source are all alike, or unlike for other reasons.

    correlation: Pearson's, of the distances between all pairs of sources and those between their answers;
                 0 where either does not vary.
    shuffled:    mean distance between each answer and the answer to the next source, over that between the
                 sources: 0 where shuffling the sources changes nothing, about 1 where it matters in full.

    Distances are of the directions of bones, facing one way: path, size and proportions do not count.
    Left out for fewer than four motions, or without bones in common.
    """
    target = answers[0].character if answers else None
    if target is None or len(answers) < FEWEST:
        return {}
    bones = shared_bones([target, *(each.character for each in sources)])
    if not bones:
        return {}
    ours, theirs = ([poses(each, bones) for each in side] for side in (sources, answers))
    pairs = list(combinations(range(len(ours)), 2))
    before, after = (np.array([pose_distance(p[i], p[j]) for i, j in pairs]) for p in (ours, theirs))
    varied = before.std() > _STILL and after.std() > _STILL
    found = {"correlation": float(np.corrcoef(before, after)[0, 1]) if varied else 0.0}
    asked, moved = (
        np.mean([pose_distance(p[i], p[(i + 1) % len(p)]) for i in range(len(p))]) for p in (ours, theirs)
    )
    return found | ({"shuffled": float(moved / asked)} if asked > _STILL else {})


RATE = 30.0
"""Frames per second of the plain questions."""
MOST = 12
"""Motions that are compared with each other."""
Progress = Callable[[], object]


@dataclass(frozen=True)
class Subject:
    """One plain question and what it is called."""

    info: CaseInfo
    question: ProbeCase


@dataclass
class Reply:
    """The answers about one subject: deviations by probe id, and sentences for probes without one.

    failed:  probe id -> why there is no answer to the rewritten question though there is one to the plain.
    refused: probe id -> why the method does not take the rewritten question, in its own words: no fault.
    """

    subject: Subject
    status: str = "ok"
    message: str = ""
    deviations: dict[str, float] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    dependence: dict[str, float] = field(default_factory=dict)


def subject(info: CaseInfo, source: Source, target: Character) -> Subject | str:
    """A plain question at 30 frames per second, or why there is none."""
    if not isinstance(source, Motion):
        return f"the source is known by {kind_of(source)} only; probes need rotations"
    return Subject(info, ProbeCase(source if source.fps == RATE else source.resample(RATE), target))


def ask(
    method: Method,
    label: str,
    subjects: Sequence[Subject],
    groups: Sequence[Sequence[Subject]] = (),
    probes: Sequence[Probe] = PROBES,
    progress: Progress = lambda: None,
) -> list[Reply]:
    """Every probe on every subject; whatever the method does wrong costs its value and no other.

    label:  what seeds are drawn for. Every question of a subject has the same seed.
    groups: subjects of like bodies in different clips, whose sources are all given to the first one's
            target, to see whether answers depend on them.
    Raises BenchError for a method that needs what probes do not have (references, other clips).
    """
    if needs := method_card(method).needs:
        raise BenchError(
            f"{label} is given {', '.join(n.replace('_', ' ') for n in needs)}, which a rewritten question "
            "does not have; only methods that see source and target alone can be probed"
        )
    replies = []
    for each in subjects:
        replies.append(_ask(method, label, each, probes))
        progress()
    return replies + [_dependence(method, label, group) for group in groups]


def _answer(method: Method, label: str, info: CaseInfo, question: ProbeCase) -> Outcome:
    case = Case(info, question.source, question.target)
    return predict(method, case, Context(seed=store.case_seed(0, label, info.id)))


def _ask(method: Method, label: str, about: Subject, probes: Sequence[Probe]) -> Reply:
    first = _answer(method, label, about.info, about.question)
    reply = Reply(about, first.status, first.message)
    for probe in probes if first.prediction else ():
        asked = probe.ask(about.question)
        if isinstance(asked, str):
            reply.skipped[probe.id] = asked
            continue
        plain = first
        if asked.plain is not about.question:
            plain = _answer(method, label, about.info, asked.plain)
        new = _answer(method, label, about.info, asked.question) if plain.prediction else plain
        if plain.prediction and new.prediction:
            places = new.prediction.positions, plain.prediction.positions
            reply.deviations[probe.id] = deviation(asked, *places)
        elif new.status == "unsupported":
            reply.refused[probe.id] = new.message
        else:
            reply.failed[probe.id] = f"{new.status}: {new.message}"
    return reply


def _dependence(method: Method, label: str, group: Sequence[Subject]) -> Reply:
    """Dependence of the answers of one target on the sources of a group, as reply of its first subject."""
    target = group[0].question.target
    sources, answers = [], []
    for each in group:
        question = ProbeCase(each.question.source, target)
        if answer := _answer(method, label, each.info, question).prediction:
            sources.append(question.source)
            answers.append(answer)
    return Reply(group[0], dependence=dependence(sources, answers))


def groups_of(infos: Sequence[CaseInfo], structure: Mapping[str, str]) -> list[list[CaseInfo]]:
    """Cases whose sources are of one structure, one per clip, at most ``MOST`` evenly chosen, where there
    are enough. structure: by character."""
    found: dict[str, dict[str, CaseInfo]] = {}
    for info in infos:
        found.setdefault(structure[info.source], {}).setdefault(info.clip, info)
    enough = [list(clips.values()) for clips in found.values() if len(clips) >= FEWEST]
    return [spread({"": listed}, min(MOST, len(listed))) for listed in enough]


def spread(infos: Mapping[str, Sequence[CaseInfo]], number: int) -> list[CaseInfo]:
    """``number`` cases, evenly from the splits given and from beginning to end of each."""
    chosen: list[CaseInfo] = []
    share = -(-number // max(len(infos), 1))
    for listed in infos.values():
        most = min(share, len(listed), number - len(chosen))
        chosen += [listed[(2 * k + 1) * len(listed) // (2 * most)] for k in range(most)]
    return chosen
