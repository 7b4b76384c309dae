"""What is kept out of training and validation for good, so that the test can ask for what nobody saw."""

from __future__ import annotations

STRUCTURES = ("h36m17",)
"""None of their bodies is trained on; of the other structures, bodies say so themselves."""

ASIDE = ("dora", "grub", "quinn", "fox")
"""One body of each other structure, none of the extreme ones, that training goes without so that it can be
steered by how it does on them. What was chosen by them has seen them: for the test they are not new."""

KINDS = (
    "limp",
    "walk_sideways",
    "stairs_down",
    "hop",
    "lunge",
    "kick_side",
    "catch",
    "salute",
    "dance_line",
    "shake_paw",
)
"""Kinds of performance that only the test has; sequences, too, do without them."""
