"""Where rows come from: told once per way of making them, with a command that makes them again."""

import shlex

import pytest
from stored import changed, store

from retarget_bench.analysis import summary
from retarget_bench.plugins.spec import Spec
from retarget_bench.tables import builder

NUMBERS = [("a>b", "c1", {"mpjpe_h.world": 1.0})]
DATASET = {
    "name": "puppets", "parameters": {"size": "tiny"}, "label": "data", "version": "2", "content": "c1",
    "notes": [],
}  # fmt: skip


def table_of(places):
    (table,) = builder.tables(summary.split_summaries(places), ["mpjpe_h.world"])
    return table


def test_splits_that_were_made_alike_are_told_together(tmp_path):
    label = "copy[rule='odd; name']"
    provenance = {"dataset": DATASET, "seeds": [3], "revision": "beef", "versions": {"numpy": "2"}}
    places = [
        changed(
            store(tmp_path, split, "m", NUMBERS, label=label, version="1", code="ab"),
            **provenance,
            date=date,
        )
        for split, date in (("intra", "2026-01-01T10:00:00+00:00"), ("cross", "2026-01-02T10:00:00+00:00"))
    ]
    table = table_of(places)
    (origin,) = table.provenance
    assert (origin.splits, origin.date, origin.seeds) == (("cross", "intra"), "2026-01-02", (3,))
    assert (origin.version, origin.code, origin.revision, origin.versions) == ("1", "ab", "beef", "numpy 2")
    words = shlex.split(origin.command)
    assert words[:3] == ["bench", "run", label]
    assert str(Spec.parse(words[words.index("-d") + 1])) == "puppets[size=tiny]"
    assert words[-4:] == ["-s", "cross,intra", "--seed", "3"]
    assert ("version", "2") in table.data


@pytest.mark.parametrize("change", [{"seeds": [1]}, {"revision": "dead"}, {"versions": {"numpy": "3"}}])
def test_what_was_made_otherwise_is_told_apart(tmp_path, change):
    provenance = {"dataset": DATASET, "seeds": [0], "revision": "beef", "versions": {"numpy": "2"}}
    one = changed(store(tmp_path, "intra", "m", NUMBERS), **provenance)
    two = changed(store(tmp_path, "cross", "m", NUMBERS), **provenance | change)
    assert [origin.splits for origin in table_of([one, two]).provenance] == [("cross",), ("intra",)]


def test_predictions_made_elsewhere_are_scored_again(tmp_path):
    place = store(tmp_path, "intra", "m", NUMBERS, origin="predictions made elsewhere")
    (origin,) = table_of([place]).provenance
    assert origin.command == "bench score FOLDER"
