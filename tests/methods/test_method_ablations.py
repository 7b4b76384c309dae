"""Ablations of papers: their printed numbers, and what each row leaves out."""

from __future__ import annotations

import humot_material
import pan_material
import pytest
import training_material

from retarget_bench.methods.pan import Pan
from retarget_bench.plugins.spec import Spec
from retarget_bench.python import ablations

ABLATION = ablations.find(Spec.parse("pan"), "table5")


def test_the_printed_numbers():
    table = ablations.published(ABLATION)
    printed = [tuple(number.text for number in numbers.values()) for numbers in table.rows.values()]
    expected = [("0.50", "1.62"), ("0.58", "2.29"), ("1.19", "2.28"), ("1.11", "48.08"), ("1.16", "3.23")]
    assert printed == expected
    assert [column.cases for column in table.columns] == ["intra", "cross"]
    assert {column.value_id for column in table.columns} == {"san_code"}


@pytest.mark.parametrize("variant", ["own", "released", "paper"])
@pytest.mark.parametrize("row", ABLATION.rows)
def test_rows_train(row, variant):
    module = pan_material.training_module(small=True, variant=variant, **ABLATION.rows[row])
    batch, memory = training_material.batch(module), {}
    losses = {phase.name: module.losses(phase.name, batch, memory) for phase in module.phases}
    assert all(term.isfinite() for terms in losses.values() for term in terms.values())
    left_out = {
        "w.o. L_kine": {"places", "again_places", "root"},
        "w.o. L_adv": {"adversarial"},
    }.get(row, set())
    assert not left_out & set(losses["generator"])
    assert ("discriminator" in losses) == (row != "w.o. L_adv")


def test_rows_differ_in_what_they_say():
    designs = [Pan(**changed).settings.design for changed in ABLATION.rows.values()]
    assert [(each.by_part, each.attention) for each in designs] == [
        (True, True),
        (False, True),
        (True, False),
        (True, True),
        (True, True),
    ]
    facts = [tuple(Pan(**changed).facts().items()) for changed in ABLATION.rows.values()]
    assert len(set(facts)) == len(facts), "no row can pass for another one"


# ---------------------------------------------------------------------------------------------------- HuMoT
HUMOT = ablations.find(Spec.parse("humot"), "losses")


def test_the_printed_numbers_are_the_overall_means_of_tables_3_to_5():
    table = ablations.published(HUMOT)
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


@pytest.mark.parametrize("row", HUMOT.rows)
def test_rows_of_humot_train(row):
    module = humot_material.training_module(**({"varied": False} | HUMOT.rows[row]))
    batch = training_material.batch(module)
    assert ("bones" in module.losses("autoencoder", batch, {})) == (row != "HuMoT, no BLC")
    same = batch["source"]["joints"].shape == batch["target"]["joints"].shape and bool(
        (batch["source"]["template"] == batch["target"]["template"]).all()
    )
    assert same == (row == "HuMoT, no SJS")
