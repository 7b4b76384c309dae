"""The protocol page: complete, and as committed."""

from __future__ import annotations

from pathlib import Path

from retarget_bench.analysis import protocols
from retarget_bench.api import MetricCard, Value
from retarget_bench.plugins import registry

PAGE = Path(__file__).parents[1] / "docs" / "protocols.md"


def built_in() -> list[MetricCard]:
    return [
        registry.create("metrics", entry.name).card
        for entry in registry.names("metrics")
        if entry.origin == registry.BUILT_IN
    ]


def test_the_committed_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == protocols.render(built_in()), (
        "a metric card has changed: write the page again with bench info protocols > docs/protocols.md"
    )


def test_every_value_has_its_section_and_a_link_to_it() -> None:
    page = protocols.render(built_in())
    for card in built_in():
        for value in card.values:
            assert page.count(f"\n### {value.id}\n") == 1
            assert f"[`{value.id}`](#{value.id.replace('.', '')})" in page


def test_signs_in_formulas_are_not_markup() -> None:
    value = Value(
        "a.b",
        "A",
        "says | a",
        "m",
        "target",
        "|p_x - g|^2 * <2>; p: *all*",
        "us",
        goal=2.0,
        needs=(),
        index="joint",
    )
    page = protocols.render([MetricCard("toy", "about nothing", "3", (value,))])
    assert "- Formula: |p_x - g|^2 * \\<2>\n  - p: \\*all*\n" in page
    assert r"| [`a.b`](#ab) | says \| a | m | → 2 |" in page
    assert "About nothing. Version 3." in page
    assert "- Needs: the prediction alone" in page
    assert "one number per joint" in page
