"""Colours of methods and of motions, the same in pictures, pages and clips.

Eight colours that stay apart for people who are colour-blind, of which any two that follow each other
differ in grey too, each dark enough for a thin line on white (a contrast of 3). Beyond eight they start
again: marks and names tell methods apart then. What a colour says is always said by something else as well.
"""

from __future__ import annotations

COLOURS = ("#0a4d9b", "#c85800", "#01a875", "#7a2a56", "#c870a4", "#5b4301", "#3f79f4", "#555d3e")
"""Of methods, by their rank in the table."""
CONTROLS = ("#444444", "#757575", "#949494")
"""Of rows that bound the scale."""
SOURCE = "#808080"
REFERENCE = "#1a1a1a"


def colour(index: int) -> str:
    """``#rrggbb`` of the method at this place of the table, counted from 0."""
    return COLOURS[index % len(COLOURS)]


def control(index: int) -> str:
    """``#rrggbb``, a grey: of the control at this place among the controls."""
    return CONTROLS[index % len(CONTROLS)]
