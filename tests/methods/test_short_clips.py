"""Clips of one frame, and of none: answered or refused in a sentence by every method that is shipped."""

from __future__ import annotations

from dataclasses import replace

import pytest

from retarget_bench.api import Case, Dataset
from retarget_bench.evaluation import predict, score
from retarget_bench.evaluation.shard_work import elsewhere
from retarget_bench.plugins import registry
from retarget_bench.results import predictions, store


def built_in(kind: registry.Kind) -> list[str]:
    return [entry.name for entry in registry.names(kind) if entry.origin == registry.BUILT_IN]


METHODS = [name for name in built_in("methods") if name != "external"]  # it needs a program


@pytest.fixture(scope="module")
def data() -> Dataset:
    return registry.create("datasets", "puppets[size=tiny]")


@pytest.fixture(scope="module")
def case(data: Dataset) -> Case:
    return data.load(data.cases("retarget", "intra")[0])


def cut(case: Case, frames: int) -> Case:
    """The first frames of a case."""
    some = slice(0, frames)
    contacts = replace(case.contacts, planted=case.contacts.planted[some])
    if contacts.pivoting is not None:
        contacts = replace(contacts, pivoting=contacts.pivoting[some])
    return replace(
        case,
        info=replace(case.info, frames=frames),
        source=case.source.at(some),
        reference=case.reference.at(some),
        alternative=case.alternative and case.alternative.at(some),
        contacts=contacts,
        touches=case.touches and tuple(replace(each, rests=each.rests[some]) for each in case.touches),
    )


def asked(name: str, data: Dataset, case: Case) -> predict.Outcome:
    method = registry.create("methods", name)
    return predict.predict(method, case, predict.context_for(method, data, case, 0))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", METHODS)
def test_one_frame_is_answered_and_scored_or_refused(name: str, data: Dataset, case: Case):
    single = cut(case, 1)
    outcome = asked(f"{name}+fit+footfix", data, single)
    assert outcome.status in ("ok", "unsupported"), outcome.message
    if outcome.status == "unsupported":
        assert outcome.message
        assert "\n" not in outcome.message
        return
    metrics = [
        each for name in built_in("metrics") if hasattr(each := registry.create("metrics", name), "compute")
    ]
    values = score.score(metrics, single, predict.as_scored(outcome.prediction)).values
    assert "mpjpe_h.world" in values


@pytest.mark.parametrize("name", METHODS)
def test_no_frames_are_refused_before_a_method_is_asked(name: str, data: Dataset, case: Case):
    outcome = asked(f"{name}+fit+footfix", data, cut(case, 0))
    assert (outcome.status, outcome.message) == ("unsupported", predict.EMPTY)


def test_a_batch_goes_on_without_cases_of_no_frames(data: Dataset, case: Case):
    method = registry.create("methods", "copy_rotations")
    cases = [cut(case, frames) for frames in (3, 0, 2)]
    contexts = [predict.context_for(method, data, each, 0) for each in cases]
    assert [each.status for each in predict.predict_all(method, cases, contexts)] == [
        "ok",
        "unsupported",
        "ok",
    ]


def test_answers_from_elsewhere_to_no_frames_are_not_scored(tmp_path, case: Case):
    empty = cut(case, 0)
    place = tmp_path / (store.case_file(empty.info.id) + ".npz")
    predictions.write_prediction(place, empty.reference, "")
    outcome = elsewhere(tmp_path, empty)
    assert (outcome.status, outcome.message) == ("invalid", predict.EMPTY)
