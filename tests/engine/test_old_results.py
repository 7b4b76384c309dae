"""Results written by earlier versions must load for ever. Each folder was written by that schema's code."""

from pathlib import Path

import pytest

from retarget_bench.analysis import summary
from retarget_bench.results import store
from retarget_bench.tables import builder
from retarget_bench.tables.rendering import RENDERERS

OLD = Path(__file__).parents[1] / "old_results"
SCHEMAS = sorted(OLD.iterdir())


@pytest.mark.parametrize("folder", SCHEMAS, ids=[folder.name for folder in SCHEMAS])
def test_old_results_load_and_show_the_same_table(folder):
    places = store.find_results(folder)
    assert len(places) == 3
    (made,) = builder.tables(summary.split_summaries(places), ["mpjpe_h.world", "fps"])
    rows = {row.label: row for row in (*made.groups[0].ranked, *made.groups[0].unranked)}
    assert rows["toy_method"].n == "6"
    assert rows["toy_method"].cells[0].value == pytest.approx(
        0.517024, rel=1e-4
    )  # 1 cm over the two heights
    assert rows["toy_method[does=picky]"].n == "3/6"
    assert rows["toy_method[does=raise]"].cells[0].text == "failed"
    for form, render in RENDERERS.items():
        assert ("out of ideas" in render([made])) == (form != "csv"), form
    assert "mpjpe_h.joint:values" in store.read_arrays(places[0])
