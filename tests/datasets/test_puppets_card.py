"""The data card names what there is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from retarget_bench.datasets.puppets.contract import VERSION
from retarget_bench.datasets.puppets.generator.corpus.families import HELD_OUT_KINDS, families, only_tested

ROOT = Path(__file__).parents[2]
PLACE = ROOT / "datasets" / "puppets" / "README.md"
CARD = PLACE.read_text(encoding="utf-8")


def rows(first: str) -> dict[str, list[str]]:
    """The table whose head begins with a word: first cell -> the others."""
    table = re.search(rf"^\| {first} \|.*\n\|[-|]+\n((?:\|.*\n)+)", CARD, re.MULTILINE)
    assert table is not None
    lines = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in table[1].splitlines()]
    return {cells[0]: cells[1:] for cells in lines}


def test_every_kind_is_listed_and_those_held_out_are_marked() -> None:
    listed = {kind: cells[-1] for kind, cells in rows("kind").items()}
    assert list(listed) == [kind for family in families() for kind in family.kinds]
    assert {kind for kind, mark in listed.items() if mark} == {k for k in listed if k in HELD_OUT_KINDS}


def test_every_body_is_listed_in_its_joint_set() -> None:
    for family in families():
        for name, body in family.bodies.items():
            joints, listed, held = rows("joint set")[body.structure.name]
            assert int(joints) == body.structure.joints
            assert name in listed.split(", ")
            assert only_tested(body) == (held == "all" or name in held.split(", "))


def test_it_is_of_this_version() -> None:
    assert f"generator version {VERSION}." in CARD


@pytest.mark.parametrize("picture", sorted(set(re.findall(r"\]\((\S+\.png)\)", CARD))))
def test_its_pictures_are_there_and_small(picture: str) -> None:
    place = (PLACE.parent / picture).resolve()
    assert place.is_relative_to(ROOT)
    assert 1_000 < place.stat().st_size < 90_000
