"""Asking one method all probes on a few cases."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import cast

import numpy as np

from retarget_bench.api import Case, CaseInfo, Context, Method, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.predict import Outcome, predict
from retarget_bench.motion import rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, kind_of
from retarget_bench.motion.roles import ancestors
from retarget_bench.results import store
from retarget_bench.verification.probe.probes import PROBES, Probe, deviation

RATE = 30.0
"""Frames per second of the plain questions."""
FEWEST, MOST = 4, 12
"""Motions that are compared with each other: a correlation of fewer says nothing."""
NOT_ASKED = "not asked"
"""Status of a probe that has no question for a case."""
_STILL = 1e-9


@dataclass(frozen=True)
class Reply:
    """The outcome of one question about a case.

    probe:  its id; "" for the plain question, and of the dependence on sources the name of its number.
    status: of the answer, or ``NOT_ASKED``. message: why there is no number.
    number: the deviation, or that of the dependence.
    """

    info: CaseInfo
    probe: str
    status: str = "ok"
    message: str = ""
    number: float | None = None


# ------------------------------------------------------------------------------------- which cases
def plain(case: Case) -> Case | str:
    """The question of a case at 30 frames per second, or why there is none."""
    motion = case.source
    if not isinstance(motion, Motion):
        return f"the source is known by {kind_of(motion)} only; probes need rotations"
    return Case(case.info, motion if motion.fps == RATE else motion.resample(RATE), case.target)


def groups_of(infos: Sequence[CaseInfo], structure: Mapping[str, str]) -> list[list[CaseInfo]]:
    """Cases whose sources are of one structure, one per clip, at most ``MOST`` evenly chosen, where there
    are enough. structure: by character."""
    clips: dict[str, dict[str, CaseInfo]] = {}
    for info in infos:
        clips.setdefault(structure[info.source], {}).setdefault(info.clip, info)
    enough = [list(alike.values()) for alike in clips.values() if len(alike) >= FEWEST]
    return [spread({"": listed}, min(MOST, len(listed))) for listed in enough]


def spread(infos: Mapping[str, Sequence[CaseInfo]], number: int) -> list[CaseInfo]:
    """``number`` cases, evenly from the splits given and from beginning to end of each."""
    chosen: list[CaseInfo] = []
    share = -(-number // max(len(infos), 1))
    for listed in infos.values():
        most = min(share, len(listed), number - len(chosen))
        chosen += [listed[(2 * k + 1) * len(listed) // (2 * most)] for k in range(most)]
    return chosen


# ------------------------------------------------------------------------------------- questions
def ask(
    method: Method,
    label: str,
    cases: Sequence[Case],
    groups: Sequence[Sequence[Case]] = (),
    probes: Sequence[Probe] = PROBES,
    progress: Callable[[], object] = lambda: None,
) -> list[Reply]:
    """Every probe on every plain case; whatever the method does wrong costs its number and no other.

    label:  the name that seeds are drawn for. Every question about a case has the same seed.
    groups: cases of like bodies in different clips, whose sources are all given to the first one's target,
            to see whether answers depend on them.
    Raises BenchError for a method that needs what probes do not have (references, other clips).
    """
    if needs := method.card.needs:
        raise BenchError(
            f"{label} is given {', '.join(n.replace('_', ' ') for n in needs)}, which a rewritten question "
            "does not have; only methods that see source and target alone can be probed"
        )

    def answer(info: CaseInfo, source: Motion, target: Character) -> Outcome:
        seed = store.case_seed(0, label, info.id)
        return predict(method, Case(info, source, target), Context(seed=seed))

    replies = []
    for case in cases:
        replies += _replies(answer, case, probes)
        progress()
    for group in groups:
        pairs: list[tuple[Prediction, Prediction]] = []
        for case in group:
            source = cast(Motion, case.source)
            if prediction := answer(case.info, source, group[0].target).prediction:
                pairs.append((source, prediction))
        replies += [Reply(group[0].info, name, number=n) for name, n in dependence(pairs).items()]
    return replies


def _replies(
    answer: Callable[[CaseInfo, Motion, Character], Outcome], case: Case, probes: Sequence[Probe]
) -> list[Reply]:
    """The plain question and, where it is answered, every probe."""
    info, source, target = case.info, cast(Motion, case.source), case.target
    first = answer(info, source, target)
    replies = [Reply(info, "", first.status, first.message)]
    for probe in probes if first.prediction else ():
        question = probe.ask(source, target)
        if isinstance(question, str):
            replies.append(Reply(info, probe.id, NOT_ASKED, question))
            continue
        plainly = first if question.plain is source else answer(info, question.plain, target)
        new = answer(info, question.source, question.target) if plainly.prediction else plainly
        number = None
        if plainly.prediction and new.prediction:
            positions = new.prediction.positions, plainly.prediction.positions
            number = deviation(question, *positions, target.height)
        replies.append(Reply(info, probe.id, new.status, new.message, number))
    return replies


# ------------------------------------------------------------------------------------- dependence
def dependence(pairs: Sequence[tuple[Prediction, Prediction]]) -> dict[str, float]:
    """Dependence of the answers of one target on their sources, from pairs of source and answer.

    A faithful method keeps distances: its answers are as like each other as their sources are. Answers of a
    method that does not look at its source are all alike, or unlike for other reasons.

    correlation: Pearson's, of the distances between all pairs of sources and those between their answers;
                 0 where either does not vary.
    shuffled:    mean distance between each answer and the answer to the next source, over that between the
                 sources: 0 where shuffling the sources changes nothing, about 1 where it matters in full.

    Distances are of the directions of bones, facing one way: path, size and proportions do not count.
    Left out for fewer than four motions, or without bones in common.
    """
    if len(pairs) < FEWEST:
        return {}
    sources, answers = zip(*pairs, strict=True)
    bones = shared_bones([answers[0].character, *(each.character for each in sources)])
    if not bones:
        return {}
    poses = [[directions(each, bones) for each in side] for side in (sources, answers)]
    two = list(combinations(range(len(pairs)), 2))
    before, after = (np.array([pose_distance(side[i], side[j]) for i, j in two]) for side in poses)
    varied = before.std() > _STILL and after.std() > _STILL
    numbers = {"correlation": float(np.corrcoef(before, after)[0, 1]) if varied else 0.0}
    moved = [
        np.mean([pose_distance(*both) for both in zip(side, [*side[1:], side[0]], strict=True)])
        for side in poses
    ]
    return numbers | ({"shuffled": float(moved[1] / moved[0])} if moved[0] > _STILL else {})


def shared_bones(characters: Sequence[Character]) -> list[tuple[str, str]]:
    """Lines between joints whose roles all bodies have: from each to the next one above it in the first,
    as the roles of both ends."""
    first = characters[0]
    shared = set.intersection(*(set(each.joint_of) for each in characters))
    bones = []
    for role in sorted(shared):
        above = (first.roles[joint] for joint in ancestors(first.skeleton, first.joint_of[role]))
        bones += [(start, role) for start in above if start in shared][:1]
    return bones


def directions(motion: Prediction, bones: Sequence[tuple[str, str]]) -> np.ndarray:
    """``(frames, bones, 3)`` unit vectors along the bones, turned so that the hips face one way."""
    joint, positions = motion.character.joint_of, motion.positions
    lines = np.stack(
        [positions[:, joint[end]] - positions[:, joint[start]] for start, end in bones], axis=1
    )
    lines /= np.maximum(np.linalg.norm(lines, axis=-1, keepdims=True), _STILL)
    if not {"left_up_leg", "right_up_leg"} <= joint.keys():
        return lines
    across = positions[:, joint["left_up_leg"]] - positions[:, joint["right_up_leg"]]
    # the hips face across x up = (-across z, 0, across x)
    yaw = np.arctan2(-across[:, 2], across[:, 0])
    return rotation.rotate(rotation.about(UP, -yaw[:, None]), lines)


def pose_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance of directions ``(frames, bones, 3)``, over the frames that both have: 0 to 2."""
    frames = min(len(a), len(b))
    return float(np.linalg.norm(a[:frames] - b[:frames], axis=-1).mean())
