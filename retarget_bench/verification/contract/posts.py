"""The checks that a post-process must pass: its own, and those of a method that it follows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from retarget_bench import defaults
from retarget_bench.api import Context, Dataset, Prediction
from retarget_bench.evaluation import predict
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions
from retarget_bench.plugins import registry
from retarget_bench.plugins.post_processors import Post, composed
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.contract.common import Check, Checks, sample
from retarget_bench.verification.contract.methods import KINDS_OF_SOURCE, check_method, undescribed


def check_post(spec: Spec, data: Dataset) -> Iterator[Check]:
    """Every check of a post-process, on the answers of the method that is used when none is named; raises
    BenchError if it cannot be built."""
    trial = _Trial(spec, data)
    yield from Checks(
        {
            "its card says what it is and what it takes": trial.card,
            "answers known by positions only are worked on, if the card accepts them": trial.positions,
        }
    )
    method = Spec.parse(defaults.METHOD)
    for check in check_method(replace(method, posts=(spec,)), data):
        yield Check(f"{method.name}+{spec.name}: {check.demand}", check.problem)


class _Trial:
    """A post-process and the cases that it is tried on."""

    def __init__(self, spec: Spec, data: Dataset) -> None:
        self.spec = spec
        self.post: Post = registry.create("posts", spec)
        self.cases = sample(data)

    def card(self) -> str | None:
        card = self.post.card
        if card.name != self.spec.name:
            return f"card.name is {card.name!r}, but the plug-in is called {self.spec.name!r}"
        if not (card.summary and card.version and card.accepts):
            return "summary, version and accepts must not be empty"
        if unknown := set(card.accepts) - set(KINDS_OF_SOURCE):
            return f"accepts {sorted(unknown)}; known are {', '.join(KINDS_OF_SOURCE)}"
        return undescribed("posts", self.spec, card.parameters)

    def positions(self) -> str | None:
        method = composed(_ByPositions(Spec.parse(defaults.METHOD)), [self.post])
        wanted = {"ok", "unsupported"} if "positions" in self.post.card.accepts else {"unsupported"}
        for case in self.cases:
            outcome = predict.predict(method, case, Context(ground=case.ground))
            if outcome.status not in wanted:
                return f"{case.info.id}: {outcome.status}: {outcome.message}"
        return None


class _ByPositions:
    """A method that keeps its rotations to itself."""

    def __init__(self, spec: Spec) -> None:
        self.method = registry.create("methods", spec)
        self.card = self.method.card

    def supports(self, source: Character, target: Character) -> str | None:
        reason: str | None = self.method.supports(source, target)
        return reason

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Positions:
        answer = self.method.retarget(source, target, context=context)
        return target.positions(answer.positions, answer.fps)
