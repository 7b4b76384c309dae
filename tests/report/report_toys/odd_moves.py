"""Three bodies, two clips, and names that break pages, of joints too: what tests of reports look at."""

from itertools import permutations

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.api.datasets import usual_splits
from tests.viewing.viewing_toys.toy_moves import PERSON, body, moving

BODIES = {'"><img src=x onerror=alert(1)>': 1.0, "Ünï 名\u202e": 1.2, "it's {{ 7*7 }} & co": 0.8}
JOINTS = {
    "<script>alert(1)</script>": ("Head", (0, 0.1, 0)),
    "\"'&amp;</g>": ("LeftHand", (0.05, 0, 0)),
    "手": ("RightHand", (-0.05, 0, 0)),
    "j" * 300: ("Spine", (0, 0.05, -0.1)),
}
CLIPS = {"<b>nod</b> 1": "<script>alert(2)</script>", 'walk\'s "2"': "walk"}


class OddMoves:
    card = DatasetCard(
        name="odd_moves",
        summary="toys",
        version="1",
        licence="CC0",
        obtain="here",
        splits=usual_splits("intra", "cross"),
    )
    label = "odd <b>moves</b>"
    notes = ("<i>a note</i>",)
    content = "odd-1"

    def __init__(self) -> None:
        self._bodies = {name: body(name, PERSON | JOINTS, size) for name, size in BODIES.items()}

    def characters(self):
        return self._bodies

    def cases(self, task, split):
        pairs = list(permutations(BODIES, 2))
        return [
            CaseInfo(f"odd_moves/{a}>{b}/{clip}", task, split, a, b, clip, kind, 45)
            for a, b in (pairs[:3] if split == "cross" else pairs[3:])
            for clip, kind in CLIPS.items()
        ]

    def load(self, info):
        source, target = (moving(self._bodies[name], 45) for name in (info.source, info.target))
        return Case(info, source, target.character, reference=target)


plugin = OddMoves
