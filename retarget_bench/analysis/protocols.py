"""The page that defines every value, written from the metric cards."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from retarget_bench.api import MetricCard, Value
from retarget_bench.plugins import registry

PROTOCOL: Mapping[str, str] = {
    "error": "what is averaged: distance, squared distance, or squared coordinate (a third of it)",
    "divided by": "the height that it is divided by, and its power: h, H1, H1^2, H2, or 1",
    "joints": "which joints count",
    "placed": "how prediction and reference are put together: world, hips, fit of a frame, ...",
    "frames": "which frames count",
    "self pairs": "pairs of a character with itself: apart, or in intra",
}
"""What tells position protocols apart, beside the unit (see ``Value.protocol``)."""

TITLE = "# Protocols"
INTRODUCTION = """\
How every number is computed. This page is written from the cards of the metrics
(`bench info --protocols`); nothing on it is edited by hand.

An error without its protocol says nothing: published position errors differ in unit, joint set, height,
treatment of the root, squared or not, and in whether pairs of a character with itself are counted. So every
value has an id, and the id fixes all of these. Numbers with different ids are never compared.

- *p* is the prediction, *g* the reference (the right answer), both as world positions of the target's
  joints: metres, Y up, x and z level, frames t, at *fps* frames per second. *h* is the target's height.
- A value is computed per case (one clip, one source, one target). Tables show the mean over pairs per
  source clip, then over clips, within a split: `self` (same character), `intra` (same structure, another
  character), `cross` (another structure). Self pairs are not part of intra unless a value says so.
- ↓ lower is better, ↑ higher is better, → best at a goal (ratios are ranked by |log(value / goal)|),
  – a description that is not ranked.
- A value that is not defined for a case is left out for that case, never set to 0 or infinity; the formula
  says when.
- *Tolerance*: by how much a value may move before a comparison of two runs calls it moved.
"""
_MARKUP = re.compile(r"[`<\[\]\\]|\*(?=\S)")
"""Signs that Markdown would read as markup in a formula; a star between blanks is none."""
ARROWS = {"lower": "↓", "higher": "↑", "target": "→", "none": "–"}


def render(cards: Iterable[MetricCard] | None = None) -> str:
    """The page, in Markdown. Without cards: those of all metrics that can be found.

    Raises BenchError where a metric cannot be imported.
    """
    shown = sorted(installed() if cards is None else cards, key=lambda card: card.name)
    parts = [TITLE, INTRODUCTION.rstrip(), _overview(shown)]
    for card in shown:
        parts.append(f"## {card.name}\n\n{_sentence(card.summary)} Version {card.version}.")
        parts += [_definition(value) for value in card.values]
    return "\n\n".join(parts) + "\n"


def installed() -> list[MetricCard]:
    """The cards of all metrics that can be found, by name."""
    return [registry.create("metrics", entry.name).card for entry in registry.names("metrics")]


def _overview(cards: Iterable[MetricCard]) -> str:
    lines = ["| id | what it says | unit | best |", "|---|---|---|---|"]
    for card in cards:
        lines += [
            f"| [`{value.id}`](#{_anchor(value.id)}) "
            f"| {_cell(value.meaning)} | {_cell(value.unit)} | {_best(value)} |"
            for value in card.values
        ]
    return "\n".join(lines)


def _definition(value: Value) -> str:
    """The section of one value."""
    facts = [
        f"{_sentence(value.meaning)}",
        "",
        f"- Column: {value.label}; unit: {value.unit}; best: {_best(value)}",
        *_formula(value.formula),
        f"- Source: {value.source}",
        f"- Needs: {', '.join(value.needs) or 'the prediction alone'}",
        f"- Tolerance: {value.tolerance:g}",
    ]
    if value.index:
        facts.append(f"- A curve: one number per {value.index}")
    if value.with_self:
        facts.append("- In the intra group this value counts the pairs of a character with itself too")
    return f"### {value.id}\n\n" + "\n".join(facts)


def _best(value: Value) -> str:
    arrow = ARROWS[value.better]
    return f"{arrow} {value.goal:g}" if value.better == "target" else arrow


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _formula(formula: str) -> list[str]:
    """A formula as a list: what is computed, then what its words mean, signs as they read."""
    first, *notes = _MARKUP.sub(r"\\\g<0>", formula).split("; ")
    return [f"- Formula: {first}", *(f"  - {note}" for note in notes)]


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _anchor(title: str) -> str:
    """The anchor that Markdown viewers give a heading: lower case, without full stops."""
    return title.lower().replace(".", "")
