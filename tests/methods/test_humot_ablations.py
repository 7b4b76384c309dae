"""HuMoT's ablations: the printed numbers, and what each row leaves out."""

from __future__ import annotations

import humot_material
import pytest
import training_material

from retarget_bench.plugins.spec import Spec
from retarget_bench.python import ablations

ABLATION = ablations.find(Spec.parse("humot"), "losses")


def test_the_printed_numbers_are_the_overall_means_of_tables_3_to_5():
    table = ablations.published(ABLATION)
    assert [(column.label, column.cases) for column in table.columns] == [
        ("all self", "self"),
        ("all intra", "intra"),
        ("all cross", "cross"),
    ]
    printed = {row: [number.text for number in numbers.values()] for row, numbers in table.rows.items()}
    assert printed == {
        "HuMoT, no SJS": ["0.0093", "0.0638", "0.0552"],
        "HuMoT, no BLC": ["0.0113", "0.0589", "0.0466"],
        "HuMoT, bodies in their own sizes": [],
        "HuMoT, bodies and limbs as they are": [],
        "HuMoT": ["0.0087", "0.0580", "0.0440"],
    }


@pytest.mark.parametrize("row", ABLATION.rows)
def test_rows_train(row):
    module = humot_material.training_module(**({"varied": False} | ABLATION.rows[row]))
    batch = training_material.batch(module)
    assert ("bones" in module.losses("autoencoder", batch, {})) == (row != "HuMoT, no BLC")
    same = batch["source"]["joints"].shape == batch["target"]["joints"].shape and bool(
        (batch["source"]["template"] == batch["target"]["template"]).all()
    )
    assert same == (row == "HuMoT, no SJS")
