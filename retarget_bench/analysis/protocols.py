"""The page of all metric definitions (docs/protocols.md), generated from the metric cards."""

import re
from collections.abc import Iterable, Mapping

from retarget_bench.api import MetricCard, Value
from retarget_bench.plugins import registry

PROTOCOL: Mapping[str, str] = {
    "error": "distance, squared distance, or squared coordinate (a third of it)",
    "divided by": "height and its power: h, H1, H1^2, H2, or 1",
    "joints": "joints that count",
    "placed": "alignment of prediction and reference: world, hips, fit of a frame, ...",
    "frames": "frames that count",
    "self pairs": "pairs of a character with itself: apart, or in intra",
}
"""Facts that distinguish position protocols, beside the unit (see ``Value.protocol``)."""

TITLE = "# Protocols"
INTRODUCTION = """\
Definitions of all values. `bench info protocols` generates this page from the metric cards; do not edit
it by hand.

Published position errors differ in unit, joint set, height, treatment of the root, squaring, and in whether
pairs of a character with itself count. Every value here has an id that fixes all of these. Compare numbers
only under the same id.

- *p* is the prediction and *g* the reference, both as world positions of the target's joints in metres: Y
  up, x and z horizontal, frame t, *fps* frames per second. *h* is the target's height.
- A value is computed per case (one clip, one source, one target). Tables show the mean over pairs per
  source clip, then over clips, within a split: `self` (same character), `intra` (same structure, another
  character), `cross` (another structure). Self pairs are not part of intra unless a value says so.
- ↓ lower is better, ↑ higher is better, → best at a goal (ratios are ranked by |log(value / goal)|),
  – a description that is not ranked.
- A value that is undefined for a case is left out for that case, never set to 0 or infinity. The formula
  says when.
- *Against the source* some values exist, too, for data without references: a table shows those that have no
  number against a reference by themselves, and all of them under `--against source`.
- In metres values in per cent of the height are shown by `--unit m`: the number of a case times the height
  of its target, then means as ever.
- *Tolerance*: the change of a value that a comparison of two runs ignores.
"""
_MARKUP = re.compile(r"[`<\[\]\\]|\*(?=\S)")
"""Signs that Markdown would read as markup in a formula; a star between blanks is none."""
ARROWS = {"lower": "↓", "higher": "↑", "target": "→", "none": "–"}


def render(cards: Iterable[MetricCard] | None = None) -> str:
    """The page, in Markdown. Without cards: those of all metrics that can be found.

    Raises BenchError where a metric cannot be imported.
    """
    if cards is None:
        cards = [registry.create("metrics", entry.name).card for entry in registry.names("metrics")]
    shown = sorted(cards, key=lambda card: card.name)
    parts = [TITLE, INTRODUCTION.rstrip(), _overview(shown)]
    for card in shown:
        parts.append(f"## {card.name}\n\n{_sentence(card.summary)} Version {card.version}.")
        parts += [_definition(value) for value in card.values]
    return "\n\n".join(parts) + "\n"


def _overview(cards: Iterable[MetricCard]) -> str:
    lines = ["| id | meaning | unit | best |", "|---|---|---|---|"]
    for value in (value for card in cards for value in card.values):
        # viewers give a heading an anchor in lower case, without full stops
        anchor = value.id.lower().replace(".", "")
        meaning, unit = (text.replace("|", "\\|") for text in (value.meaning, value.unit))
        lines.append(f"| [`{value.id}`](#{anchor}) | {meaning} | {unit} | {_best(value)} |")
    return "\n".join(lines)


def _definition(value: Value) -> str:
    """The section of one value. A formula says what is computed, then what its words mean."""
    formula, *notes = _MARKUP.sub(r"\\\g<0>", value.formula).split("; ")
    source = _MARKUP.sub(r"\\\g<0>", value.source_formula)
    facts = [
        f"{_sentence(value.meaning)}",
        "",
        f"- Column: {value.label}; unit: {value.unit}; best: {_best(value)}",
        f"- Formula: {formula}",
        *(f"  - {note}" for note in notes),
        *([f"- Against the source (`bench table --against source`): {source}"] if source else []),
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
