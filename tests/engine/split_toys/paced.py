"""Toys in splits of their own, which do not stand in the order of the alphabet."""

from dataclasses import replace

from retarget_bench.plugins import registry

SPLITS = {"slow": "the body takes its time", "fast": "the body hurries"}


class Paced:
    """The first clips of the toys are slow, the last ones fast."""

    label, notes = "paced", ()

    def __init__(self, clips=10):
        self._data = registry.create("datasets", f"toy_cases[clips={clips}]")
        self.content = f"paced {self._data.content}"
        self.card = replace(self._data.card, name="paced", splits=SPLITS)

    def characters(self):
        return self._data.characters()

    def cases(self, task, split):
        infos = self._data.cases(task, split)
        of_split = {name: infos[at::2] for at, name in enumerate(SPLITS)}
        return of_split[split]

    def load(self, info):
        return self._data.load(info)


plugin = Paced
