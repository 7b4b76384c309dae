"""Validation while training: held-out cases, predicted and scored as in ``bench run``."""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import torch
from torch import nn

from retarget_bench import defaults
from retarget_bench.api import Case, CaseInfo, Context, Dataset, Method
from retarget_bench.api.completing import complete
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import predict, score
from retarget_bench.evaluation.batches import batches
from retarget_bench.files import digest
from retarget_bench.plugins import bound
from retarget_bench.results import store
from retarget_bench.training.record import Scores, error

TASK = "retarget"


class Validator:
    """A fixed choice of cases. What it finds depends on the weights alone.

    seconds: what a validation takes, as far as is known.
    problem: what went wrong with a case the last time; "": nothing.
    """

    def __init__(
        self,
        data: Dataset,
        method: Method,
        cases: int,
        device: torch.device,
        progress: Callable[[int, int], None],
    ) -> None:
        """Load up to ``cases`` cases of each split that the method supports; ``len`` says how many.

        Cases without a reference are left out: no value of theirs could choose weights.
        progress: called with the number of cases loaded and their total.
        """
        name, self.values = defaults.VALIDATION
        method = complete(method, Method)
        self.problem, self.seconds = "", 0.0
        self._metrics = bound.metrics((name,)).of_cases
        self._data, self._device = data, device
        cast = data.characters()
        self._cast = cast

        def refused(info: CaseInfo) -> bool:
            """True where the method refuses a case by its bodies, before it is loaded."""
            in_cast = info.source in cast and info.target in cast
            return in_cast and method.supports(cast[info.source], cast[info.target]) is not None

        chosen = {
            split: choose([info for info in data.cases(TASK, split) if not refused(info)], cases)
            for split in data.card.splits
        }
        every = [info for infos in chosen.values() for info in infos]
        loaded: dict[str, Case] = {}
        for number, info in enumerate(every, 1):
            case = data.load(info)
            if case.reference is not None and not predict.refusal(method, case):
                loaded[info.id] = case
            progress(number, len(every))
        self._cases = {
            split: there
            for split, infos in chosen.items()
            if (there := [loaded[info.id] for info in infos if info.id in loaded])
        }

    def __len__(self) -> int:
        return sum(map(len, self._cases.values()))

    def fit(self, modules: nn.Module, method: Method, limit: float) -> None:
        """Leave cases out of each split, all but one at most, so that a validation takes about ``limit``
        seconds. One case of each split is timed, after another one, which loads what is needed."""
        seconds = 0.0
        with _evaluating(modules, self._device):
            for number, cases in enumerate((*list(self._cases.values())[:1], *self._cases.values())):
                begun = time.perf_counter()
                self._rows(method, cases[:1])
                seconds += (time.perf_counter() - begun) * len(cases) * (number > 0)
        share = min(1.0, limit / seconds) if seconds else 1.0
        self.seconds = share * seconds
        self._cases = {
            split: cases[: max(1, int(share * len(cases)))] for split, cases in self._cases.items()
        }

    def __call__(self, modules: nn.Module, method: Method) -> Scores:
        """Scores by split. Raises BenchError where no case gets an answer, with the reason of one."""
        self.problem, begun = "", time.perf_counter()
        with _evaluating(modules, self._device):
            rows = {split: self._rows(method, cases) for split, cases in self._cases.items()}
        if not any(rows.values()):
            raise BenchError(f"no validation case got an answer ({self.problem})")
        scores: dict[str, dict[str, float]] = {}
        for split, split_rows in rows.items():
            for value in self.values:
                if numbers := [float(row[value]) for row in split_rows if value in row]:
                    scores.setdefault(split, {})[value] = sum(numbers) / len(numbers)
            if split_rows:
                scores.setdefault(split, {})["n"] = len(split_rows)
        self.seconds = time.perf_counter() - begun
        return scores

    def decisive(self, scores: Scores) -> float:
        """The number to minimise, infinite unless every case has an answer that it can be had of."""
        complete = sum(values["n"] for values in scores.values()) == len(self)
        return error(scores) if complete else math.inf

    def _rows(self, method: Method, chosen: Sequence[Case]) -> list[Mapping[str, Any]]:
        method, rows = complete(method, Method), list[Mapping[str, Any]]()
        by_id = {case.info.id: case for case in chosen}
        for batch in batches([case.info for case in chosen], self._cast):
            cases = [by_id[each] for each in batch]
            seeds = [store.case_seed(0, "validation", case.info.id) for case in cases]
            contexts = [self._context(method, *each) for each in zip(cases, seeds, strict=True)]
            for case, outcome in zip(cases, predict.predict_all(method, cases, contexts), strict=True):
                if outcome.prediction is not None:
                    scored = predict.as_scored(outcome.prediction)
                    rows.append(score.score(self._metrics, case, scored).sound())
                elif outcome.message.startswith("KeyboardInterrupt"):
                    raise KeyboardInterrupt
                else:
                    self.problem = f"{case.info.id}: {outcome.status}: {outcome.message}"
        return rows

    def _context(self, method: Method, case: Case, seed: int) -> Context:
        """With the privileged inputs that the method's card names, as in a run."""
        return replace(predict.context_for(method, self._data, case, seed), device=str(self._device))


def choose(infos: Sequence[CaseInfo], most: int) -> list[CaseInfo]:
    """Always the same cases, spread over kinds of performance and pairs of characters."""
    waiting = sorted(infos, key=lambda info: digest(info.id, 16))
    kinds: Counter[str] = Counter()
    pairs: Counter[str] = Counter()
    chosen: list[CaseInfo] = []
    while waiting and len(chosen) < most:
        best = min(range(len(waiting)), key=lambda k: (kinds[waiting[k].kind] + pairs[waiting[k].pair], k))
        info = waiting.pop(best)
        kinds[info.kind] += 1
        pairs[info.pair] += 1
        chosen.append(info)
    return chosen


@contextmanager
def _evaluating(modules: nn.Module, device: torch.device) -> Iterator[None]:
    """Evaluation mode and no gradients; the training mode of every part and all random states come back."""
    before = [(part, part.training) for part in modules.modules()]
    devices = [device] if device.type == "cuda" else []
    modules.eval()
    try:
        with torch.random.fork_rng(devices=devices), torch.no_grad():
            yield
    finally:
        for part, training in before:
            part.training = training
