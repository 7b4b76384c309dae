"""The loop: steps of a training module's phases under a budget, with a log, validation and checkpoints.

Before every step torch and NumPy are seeded from (seed, step, rank). So what step k does depends on nothing
but the state before it, and a run that goes on from a checkpoint does what it would have done.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from multiprocessing import get_all_start_methods
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from retarget_bench.errors import BenchError
from retarget_bench.training import log, parallel, run_folder
from retarget_bench.training.config import LONGEST
from retarget_bench.training.contract import Batch, TrainingModule
from retarget_bench.training.phases import optimiser_phases, to_device
from retarget_bench.training.record import Run, Scores, Validation
from retarget_bench.training.validate import Validator
from retarget_bench.training.weight_average import WeightAverage

SAVED = 60.0
"""Seconds between checkpoints, about; a validation makes one too."""
PAUSE = {"cpu": 0.0, "cuda": 60.0}
"""Seconds between validations, at least: while the CPU scores cases, a GPU waits for hundreds of steps."""
ENDING = 2.0
"""Seconds from the last validation to the end of the process, about: weights, card, picture."""
LEAST = 0.25
"""The share of a budget of time that is training, at least, however long preparing and validating take."""
LOOKED = 10
"""Steps between looks at what a GPU measured: each look waits for it. On a CPU every step is looked at."""


@dataclass(frozen=True)
class TrainingStatus:
    """State of training for display.

    share: of the budget. losses: ``phase.term`` -> mean of the last steps. validation: where there was one;
    problem: what went wrong with some of its cases.
    """

    step: int
    seconds: float
    share: float
    losses: Mapping[str, float]
    validation: Scores | None = None
    problem: str = ""
    best: Validation | None = None


Show = Callable[[TrainingStatus], None]


class Loop:
    """Training of one module in one folder. The first process writes; ``validator`` is None in the others
    and where the data set has nothing to validate on."""

    def __init__(
        self,
        run: Run,
        module: TrainingModule,
        device: torch.device,
        folder: Path,
        validator: Validator | None,
        show: Show,
        saved: Callable[[bool], None],
        workers: int = 0,
    ) -> None:
        """saved: called after every checkpoint (``at``), with whether its weights are the ``best`` so far.
        workers: processes that draw batches beforehand; 0: each is drawn when its step begins."""
        self.workers = workers if "fork" in get_all_start_methods() else 0
        self.at, self.best = run, dict[str, Tensor]()
        self.module, self.config, self.budget, self.seed = module, run.recipe, run.limit, run.seed
        self.device, self.folder, self.validator = device, folder, validator
        self.show, self.saved = show, saved
        config = self.config
        self.rows, rest = divmod(config.batch, parallel.world())
        if rest:
            raise BenchError(
                f"a batch of {config.batch} cannot be shared evenly by {parallel.world()} processes; start "
                "a number that divides it"
            )
        module.modules.to(device)
        parallel.share_state(module.modules)
        self.phases = optimiser_phases(module, config, device)
        self._average = WeightAverage(module.modules, config.average) if config.average else None
        self._pending: list[dict[str, Tensor]] = []

    # ------------------------------------------------------------------------------------------- running
    def run(self, tensors: Mapping[str, Tensor], spent: float = 0.0) -> Run:
        """Train to the end of the budget; the run as it ended (of the first process).

        tensors: of the run's checkpoint; none before the first. spent: seconds of a budget of time that are
        over before the first step. Raises BenchError where a loss or gradient is not finite, FileError
        where nothing can be written.
        """
        if tensors:
            self._restore(tensors)
        first = parallel.rank() == 0
        self._log = log.Log(self.folder, self.at.steps) if first else None
        self._begun = time.perf_counter() - self.at.seconds - spent
        self._used, self._started = self.budget.used(self.at.steps, self.at.seconds), self._seconds
        self._saved = self._validated = time.perf_counter()
        self._step = self.at.steps
        self._batches = self._drawn()
        share = self._share()
        while share < 1.0:
            rate = self.config.rate_at(self._step, share)
            self._pending.append(self._do(rate))
            self._step += 1
            if self._average is not None:
                self._average.update(self._step)
            share = self._share()
            self._after(share, rate)
        return self.at

    def export(self) -> dict[str, Tensor]:
        """The tensors that retargeting needs, on the CPU; of averaged weights where these are kept."""
        with self._averaged():
            return {name: each.detach().cpu().clone() for name, each in self.module.export().items()}

    def _averaged(self) -> AbstractContextManager[None]:
        return nullcontext() if self._average is None else self._average.in_place()

    def _share(self) -> float:
        """The share of the budget that is used; by the first process's clock where several train
        together."""
        if self.budget.steps or self._used >= 1.0:
            return self.budget.used(self._step, self.at.seconds)
        done = (self._seconds - self._started) / (self._until - self._started)
        return parallel.first(lambda: self._used + (1.0 - self._used) * done)

    @property
    def _until(self) -> float:
        """The second in which training has to end, so that all that follows is in a budget of time."""
        least = LEAST * (1.0 - self._used) * self.budget.seconds
        return max(self.budget.seconds - self._validating - ENDING, self._started + least)

    @property
    def _validating(self) -> float:
        return self.validator.seconds if self.validator is not None else 0.0

    @property
    def _seconds(self) -> float:
        return time.perf_counter() - self._begun

    def _do(self, rate: float) -> dict[str, Tensor]:
        """One step: every phase once."""
        _seed(self.seed, self._step, parallel.rank(), self.device)
        batch = to_device(next(self._batches), self.device)
        memory: dict[str, Any] = {}
        measured: dict[str, Tensor] = {}
        for phase in self.phases:
            measured |= phase(batch, memory, rate)
        parallel.share_state(self.module.modules, buffers_only=True)
        return measured

    def _drawn(self) -> Iterator[Batch]:
        """The batches of this and all later steps."""
        draws = _Draws(self.module, self.rows, self.seed, parallel.rank())
        steps = range(self._step, int(LONGEST))
        if not self.workers:
            return map(draws.__getitem__, steps)
        # forked processes share the mapped motion; the module's tensors on a GPU are not touched there
        return iter(
            DataLoader(
                draws,
                batch_size=None,
                sampler=steps,
                num_workers=self.workers,
                pin_memory=self.device.type == "cuda",
                multiprocessing_context="fork",
            )
        )

    def _after(self, share: float, rate: float) -> None:
        """Work after a step: losses, a row of the log, validation, a checkpoint."""
        ended = share >= 1.0
        due = ended or self._step % (self.config.validate or math.inf) == 0
        row = due or self._step % log.EVERY == 0
        if row or self.device.type == "cpu" or len(self._pending) >= LOOKED:
            self._look()
        if self._log is None:
            return
        due = ended or (due and time.perf_counter() - self._validated >= PAUSE[self.device.type])
        if self.budget.seconds and not ended and self._seconds + self._validating > self._until:
            due = False  # the last one follows at once
        losses = self._log.means
        scores = None
        if due and self.validator is not None:
            with self._averaged():
                scores = self.validator(self.module.modules, self.module.method())
            self._validated = time.perf_counter()
        if row:
            columns = {
                f"{log.VALIDATION} {split} {name}": value
                for split, values in (scores or {}).items()
                for name, value in values.items()
            }
            self._log.row(self._step, self._seconds, rate, columns)
        if row and (due or time.perf_counter() - self._saved > SAVED):
            self._save(scores, ended)
        problem = self.validator.problem if scores is not None and self.validator is not None else ""
        self.show(TrainingStatus(self._step, self._seconds, share, losses, scores, problem, self.at.best))

    def _look(self) -> None:
        """Take what steps measured off the device. Raises BenchError at what is not finite."""
        steps = range(self._step - len(self._pending) + 1, self._step + 1)
        for step, measured in zip(steps, self._pending, strict=True):
            if not measured:
                raise BenchError(f"step {step}: no phase gave a loss, so there is nothing to train")
            values = parallel.mean(torch.stack(list(measured.values()))).tolist()
            terms = dict(zip(measured, values, strict=True))
            for name, value in terms.items():
                if not math.isfinite(value):
                    phase, _, term = name.partition(".")
                    what = "the gradient" if term == "norm" else f"the loss term {term}"
                    at = self.at.steps
                    kept = f"{self.folder} keeps step {at}" if at else "no checkpoint was made yet"
                    raise BenchError(
                        f"training diverged: at step {step} {what} of phase {phase} is not finite; {kept}. "
                        "Try a lower learning rate or gradient clipping in the method's preset, or another "
                        "--seed"
                    )
            if self._log is not None:
                self._log.add(terms)
        self._pending = []

    # -------------------------------------------------------------------------- checkpoints
    def _save(self, scores: Scores | None, ended: bool) -> None:
        best, history, better = self.at.best, self.at.validation, False
        if scores is not None and self.validator is not None:
            now = Validation(self._step, round(self._seconds, 1), scores)
            history, decisive = (*history, now), self.validator.decisive
            comparable = best is not None and _counts(best.scores) == _counts(scores)
            better = decisive(scores) < (decisive(best.scores) if best and comparable else math.inf)
            best = now if better else best
        # of a budget that has ended nothing is left, though what follows was quicker than expected
        seconds = max(self._seconds, self.budget.seconds) if ended else self._seconds
        kept = best.step if best else 0
        run = replace(self.at, steps=self._step, seconds=seconds, step=kept, validation=history)
        if better:
            self.best = self.export()
        tensors = {f"modules/{name}": each for name, each in self.module.modules.state_dict().items()}
        for phase in self.phases:
            tensors |= {f"optimisers/{phase.name}/{key}": each for key, each in phase.state().items()}
        if self._average is not None:
            tensors |= {f"average/{name}": each for name, each in self._average.state().items()}
        tensors |= {f"best/{name}": each for name, each in self.best.items()}
        self.at = run_folder.save(self.folder, run, tensors)
        self.saved(better)
        self._saved = time.perf_counter()

    def _restore(self, tensors: Mapping[str, Tensor]) -> None:
        """Raises BenchError where the checkpoint is of another network."""

        def part(head: str) -> dict[str, Tensor]:
            return {key.removeprefix(head): x for key, x in tensors.items() if key.startswith(head)}

        try:
            self.module.modules.load_state_dict(part("modules/"))
            for phase in self.phases:
                phase.restore(part(f"optimisers/{phase.name}/"))
            if self._average is not None:
                self._average.restore(part("average/"))
        except (RuntimeError, KeyError) as error:
            raise BenchError(
                f"{self.folder}: the checkpoint is of another network than this version of the method "
                f"builds ({str(error).splitlines()[-1].strip()}); train anew in another folder"
            ) from error
        self.best = part("best/")


class _Draws(Dataset[Batch]):
    """Step -> its batch, which depends on seed, step and rank alone."""

    def __init__(self, module: TrainingModule, rows: int, seed: int, rank: int) -> None:
        self._module, self._rows, self._seed, self._rank = module, rows, seed, rank

    def __getitem__(self, step: int) -> Batch:
        return self._module.draw(np.random.default_rng(_sequence(self._seed, step, self._rank)), self._rows)


def _counts(scores: Scores) -> dict[str, float]:
    """Cases by split: scores of other cases cannot be compared."""
    return {split: values["n"] for split, values in scores.items()}


def _sequence(seed: int, step: int, rank: int) -> np.random.SeedSequence:
    return np.random.SeedSequence([seed, step, rank])


def _seed(seed: int, step: int, rank: int, device: torch.device) -> None:
    """Seed torch for a step."""
    number = int(_sequence(seed, step, rank).generate_state(1, np.uint64)[0] >> np.uint64(1))
    if device.type == "cpu":  # the whole of torch takes a millisecond, to remember who asked
        torch.default_generator.manual_seed(number)
    else:
        torch.manual_seed(number)
