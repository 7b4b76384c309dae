"""The protocol page: complete, and as committed."""

from __future__ import annotations

from pathlib import Path

from retarget_bench.analysis import protocols
from retarget_bench.api import MetricCard
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
