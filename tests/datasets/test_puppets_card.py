"""The data card names what there is."""

from __future__ import annotations

import re
from pathlib import Path

from retarget_bench.api import SPLITS
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.contract import VERSION
from retarget_bench.datasets.puppets.generator.conventions import FPS
from retarget_bench.datasets.puppets.generator.corpus.clips import clips
from retarget_bench.datasets.puppets.generator.corpus.families import HELD_OUT_KINDS, families, only_tested

ROOT = Path(__file__).parents[2]
CARD = (ROOT / "datasets" / "puppets" / "README.md").read_text(encoding="utf-8")
MOST_WORDS = 1740


def rows(first: str) -> list[list[str]]:
    """The table whose head begins with some words, without its head."""
    table = re.search(rf"^\| {first} \|.*\n\|[-|]+\n((?:\|.*\n)+)", CARD, re.MULTILINE)
    assert table is not None
    return [[cell.strip() for cell in line.strip("|\n").split("|")] for line in table[1].splitlines()]


def named(cell: str) -> dict[str, bool]:
    """Name -> whether it is in bold, which those only tested are."""
    return {name.strip("*"): name.startswith("**") for name in cell.split(", ")}


def test_every_kind_is_listed_and_those_held_out_are_marked() -> None:
    listed = {kind: bold for _, kinds in rows("group") for kind, bold in named(kinds).items()}
    kinds = {kind for family in families() for kind in family.kinds}
    assert listed == {kind: kind in HELD_OUT_KINDS for kind in kinds}
    assert f"{len(kinds) - 2} kinds, and sequences of them" in CARD


def test_every_body_is_listed_in_its_joint_set() -> None:
    listed = {
        (structure, int(joints), name): bold
        for structure, joints, _, names in rows("joint set")
        for name, bold in named(names).items()
    }
    bodies = [body for family in families() for body in family.bodies.values()]
    assert listed == {
        (body.structure.name, body.structure.joints, body.name): only_tested(body) for body in bodies
    }


def test_the_sizes_are_right() -> None:
    for size, part, number, long, minutes, cases, _ in rows("size")[:-1]:
        data, listed = Puppets(size=size, part=part), clips(size, 0, part)
        assert cases == " / ".join(str(len(data.cases("retarget", split))) for split in SPLITS)
        assert (int(number), int(long)) == (len(listed), sum(clip.long for clip in listed))
        assert minutes == f"{sum(clip.frames for clip in listed) / FPS / 60:.1f}"


def test_it_is_of_this_version_and_short() -> None:
    assert f"generator version {VERSION}." in CARD
    assert len(CARD.split()) <= MOST_WORDS


def test_there_is_a_small_picture_of_every_kind() -> None:
    pictures = {path.stem: path.stat().st_size for path in (ROOT / "docs" / "puppets").iterdir()}
    assert set(pictures) == {kind for family in families() for kind in family.kinds}
    assert all(1_000 < size < 90_000 for size in pictures.values())
