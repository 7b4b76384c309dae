"""Results written by earlier versions must load for ever. Each folder was written by that schema's code."""

import json
from pathlib import Path

import pytest

from retarget_bench.analysis import summary
from retarget_bench.results import store
from retarget_bench.results.header import parsed
from retarget_bench.tables import builder
from retarget_bench.tables.rendering import RENDERERS

OLD = Path(__file__).parents[1] / "old_results"
SCHEMAS = sorted(OLD.iterdir())
PLACES = [place for folder in SCHEMAS for place in store.find_results(folder)]


@pytest.mark.parametrize("folder", SCHEMAS, ids=[folder.name for folder in SCHEMAS])
def test_old_results_load_and_show_the_same_table(folder):
    places = store.find_results(folder)
    assert len(places) == 3
    (made,) = builder.tables(summary.split_summaries(places), ["mpjpe_h.world", "fps"])
    rows = {row.label: row for row in made.groups[0].rows}
    assert rows["toy_method"].n == "6"
    assert rows["toy_method"].cells[0].value == pytest.approx(
        0.517024, rel=1e-4
    )  # 1 cm over the two heights
    assert rows["toy_method[does=picky]"].n == "3/6"
    assert rows["toy_method[does=raise]"].cells[0].text == "failed"
    for form, render in RENDERERS.items():
        assert ("out of ideas" in render([made])) == (form != "csv"), form
    assert "mpjpe_h.joint:values" in store.read_arrays(places[0])


@pytest.mark.parametrize("place", PLACES, ids=lambda place: place.method)
def test_a_header_is_written_as_it_was_read(place):
    """What this version adds is empty, and a field that it does not know stays."""
    facts = json.loads(place.header.read_text(encoding="utf-8")) | {"of_a_later_version": {"a": [1]}}
    again = json.loads(json.dumps(parsed(facts).plain()))
    assert again.keys() >= facts.keys()
    for name in facts.keys() - {"method", "values"}:
        assert again[name] == facts[name]
    assert again["method"].items() >= facts["method"].items()
    for name, value in facts["values"].items():
        assert again["values"][name].items() >= value.items()
    assert parsed(again).plain() == parsed(facts).plain()
