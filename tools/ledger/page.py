"""The ledger as a page."""

import re
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, get_args

from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import weights
from retarget_bench.training.learned_method import LearnedMethod
from tools.ledger.judging import CLOSE, Entry, Judge, Word

HEAD = Path(__file__).with_name("head.md")
COLUMNS = ("row", "column", "printed", "ours", "by", "on", "ratio", "verdict")
WIDTH = 120
RULES = ("---", "---", "---:", "---:", "---", "---", "---:", "---")


@dataclass(frozen=True)
class Paper:
    """A paper and its tables."""

    title: str
    tables: Sequence[Judge]


def page(papers: Sequence[Paper]) -> str:
    """The page."""
    entries = {
        paper.title: [each for table in paper.tables for each in table.entries()] for paper in papers
    }
    by = {each.by for found in entries.values() for each in found if each.by}
    head = HEAD.read_text(encoding="utf-8").format(close=f"{CLOSE * 100:.0f} %")
    parts = [head, _counts(entries), _methods(sorted(by), _variants(papers))]
    for paper in papers:
        parts += [f"## {paper.title}\n", *(_section(table) for table in paper.tables)]
    return "\n".join(parts)


def _variants(papers: Sequence[Paper]) -> dict[str, str]:
    """Method of ours -> how it differs from its paper; of tables that disagree the first."""
    found: dict[str, str] = {}
    for table in (each for paper in papers for judge in paper.tables for each in judge.measured):
        found = {**table.variants(), **found}
    return found


def _counts(entries: Mapping[str, Sequence[Entry]]) -> str:
    rows = []
    for title, found in entries.items():
        words = Counter(each.word for each in found)
        rows.append((title, *(str(words[word]) for word in get_args(Word)), str(len(found))))
    return _table(("paper", *get_args(Word), "numbers"), ("---", *["---:"] * 4), rows)


def _methods(names: Iterable[str], variants: Mapping[str, str]) -> str:
    """What the methods are whose numbers stand here, and what their weights were trained on."""
    rows = []
    for name in names:
        card = _card(name)
        rows.append((f"`{name}`", variants.get(name, ""), *(_trained(card) if card else ("", ""))))
    heads = ("ours", "variant", "shipped weights: trained on", "last training run")
    return "## Ours\n\n" + _table(heads, ("---",) * 4, rows)


def _trained(card: Mapping[str, Any]) -> tuple[str, str]:
    """Data and hours of motion; steps, time and hardware."""
    data = f"{card['data']['label']}: {_hours(card)} of motion"
    run = f"{card['steps']:,} steps in {card['seconds'] / 3600:.1f} h, {card['hardware']}"
    return data, run + (", on from earlier weights" if card.get("init") else "")


@cache
def _card(name: str) -> Mapping[str, Any] | None:
    """The card of the weights that a method is shipped with, if it is learned."""
    built: object = bound.method(Spec.parse(name)).built
    if not isinstance(built, LearnedMethod) or not (place := built.shipped().get(built.weights)):
        return None
    return weights.read_card(place)


def _section(judge: Judge) -> str:
    rows = [_row(each) for each in judge.entries()]
    others = [
        f"- `{found.method}`, {row}, {column.label}: {found.text} ({found.on})"
        for row, column, found in judge.others()
    ]
    also = "Other ways of ours:\n\n" + "\n".join(others) + "\n" if others else ""
    prose = textwrap.fill(judge.facts.prose, WIDTH, break_long_words=False, break_on_hyphens=False)
    text = f"### {judge.table.title}\n\n{prose}\n\n{_table(COLUMNS, RULES, rows)}"
    return f"{text}\n{also}" if also else text


def _row(entry: Entry) -> tuple[str, ...]:
    unit = f" [{entry.column.unit}]" if entry.column.unit not in ("", "1") else ""
    return (
        entry.row,
        entry.column.label + unit,
        entry.printed.text,
        entry.ours,
        _by(entry),
        entry.on,
        f"{entry.ratio:.2f}" if entry.ratio is not None else "",
        f"**{entry.word}**" + (f" because {entry.because}" if entry.because else ""),
    )


def _by(entry: Entry) -> str:
    """The method, and the hours of motion that its weights were trained on."""
    card = _card(entry.by) if entry.by else None
    return entry.trained or (f"`{entry.by}`" if entry.by else "") + (f", {_hours(card)}" if card else "")


def _hours(card: Mapping[str, Any]) -> str:
    return f"{card['data']['hours']:.1f} h"


def _table(heads: Sequence[str], rules: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, rules, *([_escaped(each) for each in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _escaped(text: str) -> str:
    """A cell whose stars are signs and not emphasis, as in ``NKN*``; what is bold stays so."""
    return re.sub(r"(?<!\*)\*(?!\*)", r"\\*", text).replace("|", r"\|")
