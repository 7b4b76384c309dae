"""Tables in Markdown."""

import re

import pytest
from small_tables import HOSTILE, make_table

from retarget_bench.tables.rendering import markdown

ROWS = [
    r"| method | error, world ↓<br>% of height | jerk ratio →1 | recall ↑ | n |",
    r"|---|---:|---:|---:|---:|",
    r"| ours | **3.32** | 1.03 | **0.989** | 47 |",
    r"| other | 3.44 =<br>±0.25 | **0.90** | n/a \[1\] | 46/47 |",
    "| *not ranked* |  |  |  |  |",
    r"| broken (words) | failed | failed | failed | 0/47 |",
    "| *controls, not ranked* |  |  |  |  |",
    r"| old | other version \[2\] | not run | 0.5 | 47 |",
    r"| *common cases* | 47 | 46 |  |  |",
]


def test_the_table_is_drawn_as_ever():
    lines = markdown([make_table()]).splitlines()
    assert [line for line in lines if line.startswith("|")][: len(ROWS)] == ROWS


@pytest.mark.parametrize("name", HOSTILE)
def test_names_are_text_and_stay_in_their_cells(name):
    drawn = markdown([make_table(name, name)])
    bare = re.sub(r"\\.", "", drawn)  # what is escaped means nothing to Markdown
    rows = [line for line in bare.splitlines() if line.startswith("|")]
    assert len(rows) == 14
    assert {row.count("|") for row in rows} == {6}
    assert not re.search(r"<(?!br>)", bare)
    assert not re.search(r"[`\[\]~$]", bare)
    assert "&" not in re.sub(r"&(amp|lt|gt);", "", bare)
    assert drawn.count("\n") == markdown([make_table("m", "w")]).count("\n")
