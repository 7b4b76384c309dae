"""Names of takes, the performer and the part of the data set that each belongs to."""

import re
from typing import Literal

Part = Literal["train", "validation", "test"]

_TAKE = re.compile(r"(?P<performer>\d{1,3}|[A-Za-z]+)_(?P<take>.+)")
_NUMBER = re.compile(r"\d{1,2}(?![0-9])")

TESTED = frozenset({"01", "02", "03", "06", "07", "131"})
"""Subjects that are never trained on, so that there is something to test on."""
TESTED_TAKES = frozenset({"05_03", "05_08"})
"""Takes of other subjects, likewise: they are in no part, since others of their subject are trained on."""
VALIDATION = frozenset({"17", "35", "49", "91"})
"""Subjects that training goes without to be steered by: boxing and stealth, walks, dance and gymnastics,
moods. Of none of them do converted figures with motion of several subjects (``daz``, ``ltd``) repeat
anything."""
_OF_A_FIGURE = re.compile(r"s(?P<performer>\d{1,3})t(?P<take>\d{1,2})")
"""Takes of subjects that another figure performs, as in ``daz_s05t01``."""


def performer(take: str) -> str:
    """The owner of a take's skeleton: the subject of CMU's number (two digits at least), or a figure's
    name; "" where the name is no take's."""
    match = _TAKE.fullmatch(take)
    if not match:
        return ""
    name = match["performer"]
    return f"{int(name):02d}" if name.isdigit() else name.lower()


def part_of(take: str) -> Part | None:
    """The part of a take: a function of its name alone, all of one skeleton in one part; None: none.

    A figure that performs what subjects did trains, but for takes of subjects of the other parts.
    """
    subject, rest = performer(take), take.partition("_")[2]
    if again := _OF_A_FIGURE.match(rest):
        original = f"{int(again['performer']):02d}"
        held = original in TESTED | VALIDATION
        return None if held or f"{original}_{int(again['take']):02d}" in TESTED_TAKES else "train"
    if not subject:
        return None
    if subject in TESTED:
        return "test"
    if subject in VALIDATION:
        return "validation"
    number = _NUMBER.match(rest)
    return None if number and f"{subject}_{int(number[0]):02d}" in TESTED_TAKES else "train"
