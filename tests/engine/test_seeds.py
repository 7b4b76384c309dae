"""Stochastic methods under several seeds: run apart, averaged within a case, their spread shown."""

import json
import statistics as standard
from pathlib import Path

import numpy as np
import pytest
from small_plans import asked

from retarget_bench.analysis import summary
from retarget_bench.evaluation import runner
from retarget_bench.results import store
from retarget_bench.results.header import parsed

pytestmark = pytest.mark.usefixtures("in_process", "toys")

NOISE, COPY = "toy_method[does=noise]", "toy_method"
VALUE = "mpjpe_h.world"


def carried_out(root: Path, *methods: str, seeds: int, **changes) -> list[store.ResultPaths]:
    return runner.run(asked(root, *methods, seeds=seeds, **changes), lambda done, total: None)


def rows(place: store.ResultPaths) -> dict[str, float]:
    return {entry.case: entry.values[VALUE] for entry in store.read_results(place).entries}


def test_only_stochastic_methods_run_several_times_and_their_seeds_differ(tmp_path):
    places = carried_out(tmp_path, NOISE, COPY, seeds=3)
    headers = [store.read_header(place.header) for place in places]
    assert [(h.method.label, h.seeds) for h in headers] == [
        (NOISE, (0,)),
        (NOISE, (1,)),
        (NOISE, (2,)),
        (COPY, (0,)),
    ]
    first, second, third, _ = (rows(place) for place in places)
    assert all(first[case] != second[case] != third[case] for case in first)
    single = carried_out(tmp_path / "single", NOISE, seeds=1, seed=1)
    assert rows(single[0]) == second  # the second of three seeds is what --seed 1 gives


def test_seeds_are_averaged_within_a_case_and_their_spread_stands_apart(tmp_path):
    places = carried_out(tmp_path, NOISE, COPY, seeds=3)
    (section,) = summary.split_summaries(places)
    noise, copy = section.scores
    # every clip has two cases here, so the mean over clips of the mean per clip is the mean over cases
    per_seed = [np.mean(list(rows(place).values())) for place in places[:3]]
    assert noise.means[VALUE].value == pytest.approx(np.mean(per_seed), rel=1e-12)
    assert noise.means[VALUE].n == 6
    assert noise.spread[VALUE] == pytest.approx(standard.stdev(per_seed), rel=1e-9)
    assert noise.header.seeds == (0, 1, 2)
    assert copy.spread == {}


def test_a_case_counts_as_answered_where_every_seed_answered_it(tmp_path):
    places = carried_out(tmp_path, NOISE, seeds=2)
    second = store.read_results(places[1])
    lost = second.entries[0].case
    kept = [entry for entry in second.entries if entry.case != lost]
    failed = store.CaseResult(lost, "failed", "out of luck")
    header = json.loads(places[1].header.read_text())
    header["problems"] = [{"status": "failed", "message": "out of luck", "cases": [lost]}]
    store.write_results(places[1], parsed(header), [*kept, failed], list(second.cases.values()))
    (section,) = summary.split_summaries(places)
    (score,) = section.scores
    assert (score.asked, score.ok, score.means[VALUE].n) == (6, 5, 5)


@pytest.mark.parametrize("old", [0, 1])
def test_seeds_on_other_data_do_not_hide_those_on_the_newest(tmp_path, old):
    places = carried_out(tmp_path, NOISE, seeds=2)
    header = json.loads(places[old].header.read_text())
    header["dataset"]["content"] = "what was there before"
    places[old].header.write_text(json.dumps(header | {"date": "2020-01-01"}))
    (section,) = summary.split_summaries(places)
    (score,) = section.scores
    assert score.header.seeds == (1 - old,)
    assert score.means[VALUE].value == pytest.approx(np.mean(list(rows(places[1 - old]).values())))
    assert (score.ok, score.spread) == (6, {})


def test_further_seeds_of_an_older_version_are_left_out(tmp_path):
    places = carried_out(tmp_path, NOISE, seeds=2)
    header = json.loads(places[1].header.read_text())
    header["method"]["code"] = "00000000"
    places[1].header.write_text(json.dumps(header))
    (section,) = summary.split_summaries(places)
    assert section.scores[0].spread == {}
    assert section.scores[0].header.seeds == (0,)
