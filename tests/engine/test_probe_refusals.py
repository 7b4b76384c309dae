"""A rewritten question that a method refuses is not applicable, which is no fault; a crash is one."""

from __future__ import annotations

from pathlib import Path

import pytest
from probe_questions import short_questions

from retarget_bench.analysis import summary
from retarget_bench.api import Case, MethodCard
from retarget_bench.errors import NotSupported
from retarget_bench.plugins.registry import create
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.tables import builder
from retarget_bench.tables.model import NOT_APPLICABLE
from retarget_bench.verification.probe import report
from retarget_bench.verification.probe.asking import Reply, ask
from retarget_bench.verification.probe.probes import PROBES

ONLY_22 = "takes bodies of 22 joints"
FEW, MANY = "24 fps are too few", "60 fps are too many"
REFUSED = {"source_split": ONLY_22, "source_merged": ONLY_22, "rate_24": FEW}


class Counting:
    """copy_rotations for bodies of 22 joints; refuses one frame rate, and breaks at another."""

    card = MethodCard("counting", "toy", "1")

    def supports(self, source, target):
        return None if len(source.skeleton) == 22 else ONLY_22

    def retarget(self, source, target, *, context):
        if source.fps == 24.0:
            raise NotSupported(FEW)
        if source.fps == 60.0:
            raise ValueError(MANY)
        return create("methods", Spec.parse("copy_rotations")).retarget(source, target, context=context)


@pytest.fixture(scope="module")
def subjects() -> list[Case]:
    return [each for each in short_questions() if len(each.source.skeleton) == 22]


@pytest.fixture(scope="module")
def replies(subjects: list[Case]) -> list[Reply]:
    return ask(Counting(), "counting", subjects)


def test_what_is_refused_is_kept_apart_from_what_breaks(replies: list[Reply]) -> None:
    by_case = {reply.info.id: [r for r in replies if r.info.id == reply.info.id] for reply in replies}
    assert by_case
    for of_case in by_case.values():
        assert {r.probe: r.message for r in of_case if r.status == "unsupported"} == REFUSED
        (failed,) = (r for r in of_case if r.status == "failed")
        assert failed.probe == "rate_60"
        assert MANY in failed.message


def test_refusals_are_told_with_their_reason_and_are_no_finding(replies: list[Reply]) -> None:
    number = len({reply.info.id for reply in replies})
    (finding,) = report.findings("counting", replies)
    assert f"rate_60 could not be answered in {number} of {number} cases" in finding
    assert report.refusals("counting", replies) == [
        f"counting: {name} is not applicable to {number} of {number} cases: {reason}"
        for name, reason in REFUSED.items()
    ]


def test_in_the_table_a_refused_question_is_no_number_and_says_why(
    subjects: list[Case], tmp_path: Path
) -> None:
    some = [probe for probe in PROBES if probe.id in ("turned", "source_merged")]
    answers = ask(Counting(), "counting", subjects, probes=some)
    places = report.store(Spec("rest_pose"), Spec("puppets"), answers, tmp_path)
    for place in places:
        results = store.read_results(place)
        assert {entry.status for entry in results.entries} == {"ok"}
        reasons = results.header.not_applicable
        assert reasons == {"probe.source_merged": {"cases": len(results.entries), "reason": ONLY_22}}
    sound = Spec("copy_rotations")  # a column in which nobody has a number would not be there
    beside = ask(create("methods", sound), "copy_rotations", subjects, probes=some)
    places += report.store(sound, Spec("puppets"), beside, tmp_path)
    tables = builder.tables(summary.split_summaries(places), ["probe.turned", "probe.source_merged"])
    rows = [row for each in tables for group in each.groups for row in group.rows]
    assert {row.label for row in rows} == {"rest_pose", "copy_rotations"}
    for row in rows:
        turned, merged = row.cells
        assert turned.value is not None
        refused = (merged.text, merged.reason) == (NOT_APPLICABLE, ONLY_22)
        assert refused == (merged.value is None) == (row.label == "rest_pose")


def test_rows_of_methods_that_were_probed_on_other_cases_go(subjects: list[Case], tmp_path: Path) -> None:
    same_split = [subject for subject in subjects if subject.info.split == subjects[0].info.split]
    assert len(same_split) > 1
    left = {}
    for name, chosen in (
        ("rest_pose", same_split),
        ("copy_rotations", same_split),
        ("bone_directions", same_split[:1]),
    ):
        replies = ask(create("methods", Spec(name)), name, chosen, probes=PROBES[:1])
        report.store(Spec(name), Spec("puppets"), replies, tmp_path)
        left[name] = sorted(place.method for place in store.find_results(tmp_path, report.TASK))
    assert left["copy_rotations"] == ["copy_rotations", "rest_pose"]
    assert left["bone_directions"] == ["bone_directions"]
