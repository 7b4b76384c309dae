"""One case of each split of the puppets."""

from dataclasses import replace

from retarget_bench.api.datasets import usual_splits
from retarget_bench.plugins import registry


class FewPuppets:
    """The puppets' first case of each split, for runs that end."""

    content, label, notes = "few puppets 1", "few puppets", ()

    def __init__(self):
        self._data = registry.create("datasets", "puppets[size=tiny]")
        self.card = replace(self._data.card, name="few_puppets", splits=usual_splits("self", "cross"))
        self.characters, self.load = self._data.characters, self._data.load

    def cases(self, task, split):
        return self._data.cases(task, split)[:1]


plugin = FewPuppets
