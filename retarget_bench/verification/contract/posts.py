"""The checks that a post-processor must pass: its own, and those of a method that it follows."""

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
from retarget_bench.verification.contract.common import KINDS_OF_SOURCE, Check, Trial, demand, sample
from retarget_bench.verification.contract.methods import MethodTrial


class PostTrial(Trial[Post]):
    """Checks of a post-processor, with those of the default method that it follows."""

    kind = "posts"

    def __init__(self, spec: Spec, data: Dataset) -> None:
        super().__init__(spec)
        self.data = data
        self.cases = sample(data)

    def __iter__(self) -> Iterator[Check]:
        yield from super().__iter__()
        method = Spec.parse(defaults.METHOD)
        for check in MethodTrial(replace(method, posts=(self.spec,)), self.data):
            yield Check(f"{method.name}+{self.spec.name}: {check.demand}", check.problem)

    @demand("its card says what it is and what it takes")
    def card(self) -> str | None:
        card = self.plugin.card
        if not (card.summary and card.version and card.accepts):
            return "summary, version and accepts must not be empty"
        if unknown := set(card.accepts) - set(KINDS_OF_SOURCE):
            return f"accepts {sorted(unknown)}; known are {', '.join(KINDS_OF_SOURCE)}"
        return self.misnamed(card.name) or self.undescribed(card.parameters)

    @demand("answers known by positions only are worked on, if the card accepts them")
    def positions(self) -> str | None:
        method = composed(_ByPositions(Spec.parse(defaults.METHOD)), [self.plugin])
        wanted = {"ok", "unsupported"} if "positions" in self.plugin.card.accepts else {"unsupported"}
        for case in self.cases:
            outcome = predict.predict(method, case, Context(ground=case.ground))
            if outcome.status not in wanted:
                return f"{case.info.id}: {outcome.status}: {outcome.message}"
        return None


class _ByPositions:
    """A method whose answers are positions only."""

    def __init__(self, spec: Spec) -> None:
        self.method = registry.create("methods", spec)
        self.card = self.method.card

    def supports(self, source: Character, target: Character) -> str | None:
        reason: str | None = self.method.supports(source, target)
        return reason

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Positions:
        answer = self.method.retarget(source, target, context=context)
        return target.positions(answer.positions, answer.fps)
