"""The ledger: every number printed in the three papers, with ours (``python -m tools.ledger``)."""

import tomllib
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from tools.ledger.judging import Judge, Reason, TableFacts
from tools.ledger.measured import result_tables
from tools.ledger.page import Paper, page
from tools.ledger.printed import table

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "ledger.md"
FACTS = Path(__file__).with_name("ledger.toml")


class PaperFacts(BaseModel):
    """A paper, and what the ledger knows of its tables. reasons: of all of them, before their own."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str
    reasons: tuple[Reason, ...] = ()
    tables: tuple[TableFacts, ...]


def facts() -> list[PaperFacts]:
    """What ``ledger.toml`` says."""
    found = tomllib.loads(FACTS.read_text(encoding="utf-8"))["papers"]
    return [PaperFacts.model_validate(each) for each in found]


def papers() -> list[Paper]:
    """Papers and their tables, with ours read."""
    found = facts()
    names = {name for paper in found for each in paper.tables for name in each.results}
    pages = {name: result_tables(ROOT / "results" / name) for name in sorted(names)}
    return [
        Paper(
            paper.title,
            [Judge(table(each.table), each.after(paper.reasons), pages) for each in paper.tables],
        )
        for paper in found
    ]


def written() -> str:
    """The text of the page."""
    return page(papers())
