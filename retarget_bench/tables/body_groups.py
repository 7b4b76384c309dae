"""Which group of bodies a table shows, and what is said of the others."""

from collections.abc import Mapping, Sequence

from retarget_bench.analysis.selection import PEOPLE
from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.errors import BenchError


def shown(found: Sequence[SplitSummary], bodies: str) -> tuple[list[SplitSummary], list[str]]:
    """The sections of a group of bodies, and sentences about what is left out.

    bodies: one of ``selection.BODIES``, ``all``, or "": people, or all where there are none.
    Raises BenchError where there are none of these bodies.
    """
    wanted = wanted_group([section.bodies for section in found], bodies)
    kept = [section for section in found if wanted in ("all", section.bodies)]
    cases: dict[str, dict[str, int]] = {}
    for section in found if wanted != "all" else ():
        if section.bodies != wanted:
            asked = max(score.asked for score in section.scores)
            cases.setdefault(section.bodies, {})[section.split] = asked
    hints = others(cases, "bench table")
    variants = dict.fromkeys(label for section in kept for label in section.variants)
    if variants:
        hints.append(f"variants left out: {', '.join(variants)}: bench table --variants")
    return kept, hints


def wanted_group(there: Sequence[str], bodies: str) -> str:
    """The group of bodies to show out of those that there are; see ``shown``."""
    if bodies not in ("", "all", *there):
        known = ", ".join(dict.fromkeys(filter(None, there)))
        known = known or "no groups of bodies: these results are older than those"
        raise BenchError(f"no case is between bodies of the group {bodies!r}; there are {known}")
    return bodies or (PEOPLE if PEOPLE in there else "all")


def others(cases: Mapping[str, Mapping[str, int]], command: str) -> list[str]:
    """Sentences about groups of bodies that are left out: group -> split -> cases."""
    hints = []
    for group, splits in cases.items():
        of_splits = ", ".join(f"{split} {number}" for split, number in splits.items())
        named = group if group == PEOPLE else f"{group} bodies"
        hints.append(f"{named} (cases: {of_splits}) have a table of their own: {command} --bodies {group}")
    return hints
