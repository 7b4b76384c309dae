"""The toys without right answers: the tall body has real motion, of two kinds; the small has none."""

from dataclasses import replace

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.motion.character import Character
from retarget_bench.plugins.registry import create
from retarget_bench.plugins.spec import Spec

KINDS = ("hop", "rest")


class ToyApart:
    """Parameters: ``clips``, how many of each body."""

    card = DatasetCard("toy_apart", "toys apart", "1", "CC0", "here", splits=usual_splits("cross"))
    label = "toy_apart"
    notes = ()

    def __init__(self, clips: int = 12) -> None:
        self.clips, self.content = clips, f"toy-apart-{clips}"
        self._toys = create("datasets", Spec.parse(f"toy_cases[clips={2 * clips}]"))

    def characters(self):
        return {name: self._named(body) for name, body in self._toys.characters().items()}

    def cases(self, task, split):
        return [
            self._info(a, b, n)
            for a, b in (("small", "tall"), ("tall", "small"))
            for n in range(self.clips)
        ]

    def load(self, info):
        case = self._toys.load(replace(info, source=info.source, target=info.target))
        target = self._named(case.target)
        source = replace(case.source, character=self._named(case.source.character))
        if info.source != info.target:
            return Case(info, source, target)
        return Case(info, source, target, reference=replace(case.reference, character=target))

    def real(self, task, structure):
        if structure != "tall":
            return []
        return [self._info("tall", "tall", n) for n in range(self.clips, 2 * self.clips)]

    def _named(self, body: Character) -> Character:
        """Every body is a structure of its own."""
        return replace(body, structure=body.name)

    def _info(self, source, target, number):
        kind = KINDS[number % 2]
        case = f"toy/{source}>{target}/clip {number}"
        return CaseInfo(case, "retarget", "cross", source, target, f"clip {number}", kind, 12)


plugin = ToyApart
