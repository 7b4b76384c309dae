"""HuMoT's ablations: the printed numbers, and what each row leaves out."""

from __future__ import annotations

import humot_material
import pytest

from retarget_bench.plugins.spec import Spec
from retarget_bench.tables.published import published_tables
from retarget_bench.training import ablation_runner

TABLE = ablation_runner.find(Spec.parse("humot"), "losses")


@pytest.mark.parametrize(
    ("name", "column"),
    [("humot-table3", "Self"), ("humot-table4", "Intra-structural"), ("humot-table5", "Cross-structural")],
)
def test_the_printed_numbers_are_those_of_the_published_tables(name, column):
    table = published_tables.published(name)
    overall = next(each.id for each in table.columns if each.mean_of)
    printed = {row.method: row.values[overall][0] for row in table.rows}
    ours = {row.label: float(row.printed[column]) for row in TABLE.rows if row.printed}
    assert ours == {label: printed[label] for label in ("HuMoT, no SJS", "HuMoT, no BLC", "HuMoT")}


@pytest.mark.parametrize("row", TABLE.rows, ids=lambda row: row.label)
def test_rows_train(row):
    module = humot_material.training_module(**({"varied": False} | row.parameters))
    batch = humot_material.batch(module)
    assert ("bones" in module.losses("autoencoder", batch, {})) == (row.label != "HuMoT, no BLC")
    same = batch["given"]["joints"].shape == batch["asked"]["joints"].shape and bool(
        (batch["given"]["template"] == batch["asked"]["template"]).all()
    )
    assert same == (row.label == "HuMoT, no SJS")
