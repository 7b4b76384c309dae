"""The rows of docs/printed-numbers.md that are ours, computed again where the clips are at hand."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import retarget_bench as rb

PAGE = Path(__file__).parents[1] / "docs" / "printed-numbers.md"
GOBLIN, MOUSEY, VEGAS = "Goblin_m", "Mousey_m", "BigVegas"
WITHIN = ((GOBLIN, MOUSEY), (MOUSEY, GOBLIN))
SELF = ((GOBLIN, GOBLIN), (MOUSEY, MOUSEY))
COLUMNS = (
    ("humot_mpjpe", 100.0, WITHIN),
    ("humot_mpjpe", 100.0, ((VEGAS, GOBLIN),)),
    ("humot_mpjpe", 100.0, ((VEGAS, MOUSEY),)),
    ("san_code", 1.0, (*WITHIN, *SELF)),
    ("san_code", 1.0, ((VEGAS, GOBLIN), (VEGAS, MOUSEY))),
)
"""Value, factor to the page's unit, and pairs of each column."""


def written() -> dict[str, list[str]]:
    """Method -> the numbers of its row."""
    rows = re.findall(r"^\| `([^`]+)`[^|]*\|((?: [\d.]+ \|){5})$", PAGE.read_text(encoding="utf-8"), re.M)
    return {method: numbers.strip(" |").split(" | ") for method, numbers in rows}


def test_the_page_is_short_and_has_the_rows_that_are_computed_again() -> None:
    assert len(PAGE.read_text(encoding="utf-8").split()) <= 1200
    assert [method.partition("[")[0] for method in written()] == ["copy_rotations"] * 6 + ["ik"] * 2


@pytest.mark.slow
def test_rows_are_those_of_the_clips_at_hand(real_data: Path, tmp_path: Path) -> None:
    root = real_data / "mixamo_san"
    if not root.is_dir():
        pytest.skip("no clips of Mixamo")
    rows = rb.run(
        list(written()),
        dataset="mixamo[protocol=san]",
        root=str(root),
        metrics=("papers",),
        out=str(tmp_path),
        timed=False,
    ).rows
    for method, numbers in written().items():
        own = rows[rows.method == method]
        for number, (value, factor, pairs) in zip(numbers, COLUMNS, strict=True):
            shown = own[own.value_id == value].set_index(["source", "target"]).value
            means = [shown.loc[pair].mean() for pair in pairs]
            assert f"{factor * np.mean(means):.2f}" == number, (method, value, pairs)
