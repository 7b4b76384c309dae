"""Asking one method all probes on a few cases of a data set, or on two BVH files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from retarget_bench.api import Case, CaseInfo, Context, Method, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.predict import predict
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.results import store
from retarget_bench.verification.probe.blindness import FEWEST, dependence
from retarget_bench.verification.probe.probes import PROBES, Probe, ProbeCase, deviation

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
    """What came of one subject: deviations by probe id, and sentences of those that gave none.

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


def subject(info: CaseInfo, source: Prediction, target: Character) -> Subject | str:
    """A plain question at 30 frames per second, or why there is none."""
    if not isinstance(source, Motion):
        return "the source is known by joint positions only; probes need rotations"
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
    if needs := tuple(getattr(method.card, "needs", ())):
        raise BenchError(
            f"{label} is given {', '.join(n.replace('_', ' ') for n in needs)}, which a rewritten question "
            "does not have; only methods that see source and target alone can be probed"
        )
    replies = []
    for each in subjects:
        replies.append(_ask(_Asking(method, label, each), probes))
        progress()
    return replies + [_dependence(method, label, group) for group in groups]


class _NoAnswer(BenchError):
    """A question without an answer, with the status and message of its outcome."""

    def __init__(self, status: str, message: str) -> None:
        super().__init__(f"{status}: {message}")
        self.status, self.message = status, message


class _Asking:
    """One method and one subject: questions in, places of the answer out, each asked once."""

    def __init__(self, method: Method, label: str, about: Subject) -> None:
        self.method, self.about = method, about
        self.seed = store.case_seed(0, label, about.info.id)
        self._plain: dict[int, np.ndarray] = {}

    def answer(self, question: ProbeCase) -> Prediction:
        """Raises _NoAnswer."""
        case = Case(self.about.info, question.source, question.target)
        outcome = predict(self.method, case, Context(seed=self.seed))
        if outcome.prediction is None:
            raise _NoAnswer(outcome.status, outcome.message)
        return outcome.prediction

    def plain(self, question: ProbeCase) -> np.ndarray:
        """``(frames, joints, 3)`` of a plain question. Raises _NoAnswer."""
        if id(question) not in self._plain:
            self._plain[id(question)] = self.answer(question).positions
        return self._plain[id(question)]


def _ask(asking: _Asking, probes: Sequence[Probe]) -> Reply:
    about = asking.about
    try:
        asking.plain(about.question)
    except _NoAnswer as error:
        return Reply(about, error.status, error.message)
    reply = Reply(about)
    for probe in probes:
        asked = probe.ask(about.question)
        if isinstance(asked, str):
            reply.skipped[probe.id] = asked
            continue
        try:
            plain = asking.plain(asked.plain)
            new = asking.answer(asked.question).positions
        except _NoAnswer as error:
            if error.status == "unsupported":
                reply.refused[probe.id] = error.message
            else:
                reply.failed[probe.id] = str(error)
            continue
        reply.deviations[probe.id] = deviation(asked, new, plain)
    return reply


def _dependence(method: Method, label: str, group: Sequence[Subject]) -> Reply:
    """How the answers of one target depend on the sources of a group; noted with its first subject."""
    first = group[0]
    questions = [
        Subject(each.info, ProbeCase(each.question.source, first.question.target)) for each in group
    ]
    sources, answers = [], []
    for each in questions:
        try:
            answers.append(_Asking(method, label, each).answer(each.question))
        except _NoAnswer:
            continue
        sources.append(each.question.source)
    found = dependence(sources, answers)
    return Reply(first, dependence=found)


def groups_of(infos: Sequence[CaseInfo], structure: Mapping[str, str]) -> list[list[CaseInfo]]:
    """Cases whose sources are of one structure, one per clip, at most ``MOST`` evenly chosen, where there
    are enough. structure: by character."""
    found: dict[str, dict[str, CaseInfo]] = {}
    for info in infos:
        found.setdefault(structure[info.source], {}).setdefault(info.clip, info)
    enough = [list(clips.values()) for clips in found.values() if len(clips) >= FEWEST]
    return [spread({"": listed}, min(MOST, len(listed))) for listed in enough]


def pieces(whole: Subject) -> list[Subject]:
    """A long clip in pieces of equal length, at most ``MOST``; none where they would be under a second."""
    frames, motion = whole.question.source.frames, whole.question.source
    number = min(MOST, int(frames // RATE))
    if number < FEWEST:
        return []
    length = frames // number
    return [
        Subject(
            whole.info, ProbeCase(motion.at(slice(k * length, (k + 1) * length)), whole.question.target)
        )
        for k in range(number)
    ]


def spread(infos: Mapping[str, Sequence[CaseInfo]], number: int) -> list[CaseInfo]:
    """``number`` cases, evenly from the splits given and from beginning to end of each."""
    chosen: list[CaseInfo] = []
    share = -(-number // max(len(infos), 1))
    for listed in infos.values():
        most = min(share, len(listed), number - len(chosen))
        chosen += [listed[(2 * k + 1) * len(listed) // (2 * most)] for k in range(most)]
    return chosen
