"""Questions that the tests of probes ask: short clips of puppets in all structures and rest poses."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from retarget_bench.api import Case
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.probe.asking import groups_of, plain

DATA = bound.dataset(Spec.parse("puppets")).built
SPLITS = ("intra", "cross")


@cache
def short_questions() -> list[Case]:
    """Ten short questions, two from each structure to another body, in all rest poses."""
    by_structure: dict[str, list[Case]] = {}
    for info in [info for split in SPLITS for info in DATA.cases("retarget", split)]:
        structure = DATA.characters()[info.source].structure
        if len(by_structure.setdefault(structure, [])) < 2:
            case = DATA.load(info)
            cut = replace(case, info=replace(info, frames=31), source=case.source.at(slice(0, 31)))
            question = plain(cut)
            assert isinstance(question, Case)
            by_structure[structure].append(question)
    assert len(by_structure) == 5
    return [each for pair in by_structure.values() for each in pair]


@cache
def clips_together() -> list[list[Case]]:
    """Clips of one structure each, two structures."""
    structure = {name: body.structure for name, body in DATA.characters().items()}
    groups = []
    for listed in groups_of(DATA.cases("retarget", "intra"), structure)[:2]:
        groups.append([plain(DATA.load(info)) for info in listed[:6]])
    return groups
