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
    found: dict[str, list[Case]] = {}
    for info in [info for split in SPLITS for info in DATA.cases("retarget", split)]:
        structure = DATA.characters()[info.source].structure
        if len(found.setdefault(structure, [])) < 2:
            case = DATA.load(info)
            cut = replace(case, info=replace(info, frames=31), source=case.source.at(slice(0, 31)))
            asked = plain(cut)
            assert isinstance(asked, Case)
            found[structure].append(asked)
    assert len(found) == 5
    return [each for pair in found.values() for each in pair]


@cache
def clips_together() -> list[list[Case]]:
    """Clips of one structure each, two structures."""
    structure = {name: body.structure for name, body in DATA.characters().items()}
    found = []
    for listed in groups_of(DATA.cases("retarget", "intra"), structure)[:2]:
        found.append([plain(DATA.load(info)) for info in listed[:6]])
    return found
