"""Questions that the tests of probes ask: short clips of puppets in all structures and rest poses."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.probe.asking import Subject, groups_of, subject

DATA = bound.dataset(Spec.parse("puppets")).built
SPLITS = ("intra", "cross")


@cache
def short_questions() -> list[Subject]:
    """Ten short questions, two from each structure to another body, in all rest poses."""
    found: dict[str, list[Subject]] = {}
    for info in [info for split in SPLITS for info in DATA.cases("retarget", split)]:
        structure = DATA.characters()[info.source].structure
        if len(found.setdefault(structure, [])) < 2:
            case = DATA.load(info)
            asked = subject(replace(info, frames=31), case.source.at(slice(0, 31)), case.target)
            assert isinstance(asked, Subject)
            found[structure].append(asked)
    assert len(found) == 5
    return [each for pair in found.values() for each in pair]


@cache
def clips_together() -> list[list[Subject]]:
    """Clips of one structure each, two structures."""
    structure = {name: body.structure for name, body in DATA.characters().items()}
    found = []
    for listed in groups_of(DATA.cases("retarget", "intra"), structure)[:2]:
        cases = [(info, DATA.load(info)) for info in listed[:6]]
        found.append([subject(info, case.source, case.target) for info, case in cases])
    return found
