"""Plans (methods x data sets x splits) and the keys of their results."""

import shlex
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import Any

from retarget_bench import defaults
from retarget_bench.api import CaseInfo, Dataset
from retarget_bench.api.datasets import chosen_splits
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import clips
from retarget_bench.evaluation.batches import RULE, batches
from retarget_bench.evaluation.cases import listed
from retarget_bench.evaluation.prediction import environments
from retarget_bench.evaluation.settings import Settings, Stage
from retarget_bench.evaluation.tasks import RETARGET, derive
from retarget_bench.files import facts_digest
from retarget_bench.plugins import assets, bound, registry
from retarget_bench.plugins.bound import BoundDataset, BoundMethod, BoundMetrics
from retarget_bench.plugins.code_hash import folder_hash
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store

OWN_CASES = (RETARGET, "probe")
"""Tasks whose cases are the data set's own."""


class Plan(Settings):
    """A request. Plain data throughout: it travels to worker processes.

    splits:   of the data sets; none: all that they have.
    clips:    texts with patterns of the clips that are asked for, see ``clips.py``; none: all.
    stage:    predict only, score only, or both.
    external: a folder of predictions made elsewhere, to be scored under the name ``methods[0]``.
    """

    methods: tuple[Spec, ...] = field(kw_only=False)
    datasets: tuple[Spec, ...] = field(kw_only=False)
    splits: tuple[str, ...] = ()
    metrics: tuple[str, ...] = ()
    clips: tuple[str, ...] = ()
    out: Path = field(default=Path(defaults.OUT))
    jobs: int = field(default=1)
    stage: Stage = "run"
    external: Path | None = None
    plugin_files: tuple[tuple[str, registry.Kind], ...] = field(default_factory=registry.files)


def data_of(bound: BoundDataset, task: str = RETARGET) -> Dataset:
    """The data set, or that of a derived task, which is made from its motion once a process."""
    return bound.built if task in OWN_CASES else _derived(bound, task)


@cache
def _derived(bound: BoundDataset, task: str) -> Dataset:
    return derive(bound.built, Spec.parse(task))


@lru_cache(maxsize=16)
def cases(bound: BoundDataset, task: str, split: str) -> Sequence[CaseInfo]:
    """The cases of a split, which all methods share: there may be a million. Raises BenchError."""
    return listed(data_of(bound, task), Spec.parse(task).name, split)


@lru_cache(maxsize=16)
def _batches(bound: BoundDataset, task: str, split: str) -> Sequence[tuple[str, ...]]:
    """Their ids in batches."""
    return batches(cases(bound, task, split), data_of(bound, task).characters())


@dataclass(frozen=True)
class EvaluationUnit:
    """One method on one split of one data set: a result file and its keys.

    seed_number: which of several seeds of a stochastic method this is; ``plan.seed`` is that seed.
    """

    plan: Plan
    dataset: BoundDataset
    split: str
    method: BoundMethod
    seed_number: int = 0

    @property
    def data(self) -> Dataset:
        return data_of(self.dataset, self.plan.task)

    @property
    def metrics(self) -> BoundMetrics:
        return bound.metrics(self.plan.metrics)

    @cached_property
    def infos(self) -> Sequence[CaseInfo]:
        return cases(self.dataset, self.plan.task, self.split)

    @cached_property
    def requested(self) -> Sequence[CaseInfo]:
        """The cases of the clips that the plan asks for."""
        limits = self.plan.clips, self.plan.limit or 0
        return clips.chosen(self.infos, *limits) if any(limits) else self.infos

    @cached_property
    def known_as(self) -> Spec:
        """The method as results name it: by its weights, and by the lock of another environment."""
        if self.plan.external:
            return self.method.spec
        spec = self.method.known_as
        return replace(spec, environment=environments.label(self.environment)) if self.environment else spec

    @cached_property
    def paths(self) -> store.ResultPaths:
        name = self.known_as.slug + (f".seed-{self.seed_number}" if self.seed_number else "")
        task = Spec.parse(self.plan.task).slug
        return store.ResultPaths(self.plan.out, self.dataset.slug, task, self.split, name)

    @cached_property
    def prediction_facts(self) -> dict[str, Any]:
        """Facts that predictions depend on; ``store.case_key`` adds the case."""
        external = self.plan.external
        facts = {
            "method": self.method.spec.name,
            "parameters": dict(self.known_as.parameters),
            "code": folder_hash(external) if external else self.method.code,
            "weights": "" if external else str(self.method.built.weights_hash),
            "dataset": self.dataset.spec.name,
            "dataset_parameters": self.dataset.parameters,
            "content": self.data.content,
            "task": self.plan.task,
            "split": self.split,
            "seed": self.plan.seed,
        }
        if not external and (held := assets.asset_hashes(self.method.built)):
            facts["assets"] = held
        if self.known_as.posts:
            facts["posts"] = [[post.name, dict(post.parameters)] for post in self.known_as.posts]
        if self.environment:
            facts["environment"] = environments.key_facts(self.environment)
        return facts | ({"batches": RULE} if self.in_batches else {})

    @property
    def environment(self) -> str:
        """Where the method answers, if that is another environment than this one."""
        return "" if self.plan.external else self.method.spec.environment

    @property
    def lock(self) -> str:
        return str(environments.facts(self.environment)["lock"]) if self.environment else ""

    @property
    def in_batches(self) -> bool:
        """True if the method takes several cases at once: others are asked them one after the other."""
        return self.plan.external is None and self.method.built.retarget_batch is not None

    @cached_property
    def batches(self) -> Sequence[tuple[str, ...]]:
        """The ids of all cases, in the batches that methods are asked them in."""
        return _batches(self.dataset, self.plan.task, self.split)

    @cached_property
    def keys(self) -> dict[str, str]:
        prediction = facts_digest(self.prediction_facts)
        facts = {"prediction": prediction, "metrics": self.metrics.versions}
        return {"prediction_key": prediction, "score_key": facts_digest(facts)}


def evaluation_units(plan: Plan) -> list[EvaluationUnit]:
    """Every unit of a plan. Raises BenchError for unknown splits, methods, data sets, parameters."""
    if plan.isolate:
        _check_isolation(plan.isolate)
    return [
        EvaluationUnit(replace(plan, seed=plan.seed + number), data, split, method, number)
        for data in dict.fromkeys(map(bound.dataset, plan.datasets))
        for split in chosen_splits(data_of(data, plan.task), plan.splits)
        for method in methods_of(plan)
        for number in range(_seeds(plan, method))
    ]


def _check_isolation(command: str) -> None:
    """Raises BenchError where methods cannot be started under such a command."""
    try:
        word = shlex.split(command)[0]
    except (ValueError, IndexError):
        raise BenchError(
            f"methods cannot be started under {command!r}; name a command, such as bwrap"
        ) from None
    if shutil.which(word) is None:
        raise BenchError(f"methods are to be started under {word}, which is not installed here")


def methods_of(plan: Plan) -> list[BoundMethod]:
    """The methods of a plan, each once, also where its weights are given by several paths."""
    if plan.external:
        return [BoundMethod(spec) for spec in dict.fromkeys(plan.methods)]
    methods = {}
    for method in map(placed, plan.methods):
        methods[method.known_as] = method
    return list(methods.values())


def _seeds(plan: Plan, method: BoundMethod) -> int:
    """The number of seeds that a method runs with."""
    return plan.seeds if not plan.external and method.card.stochastic else 1


def placed(spec: Spec | str) -> BoundMethod:
    """The method with the paths of its environment in full; of its card's one, where none is given.

    Raises BenchError where post-processors follow what is no plug-in there.
    """
    method = bound.method(spec)
    written = method.spec.environment or method.card.environment
    environment = environments.in_full(written)
    if method.spec.posts and environments.own_worker(environment):
        raise BenchError(
            f"{method.spec}: post-processors work where the method does, and {written!r} is without this "
            "package"
        )
    return bound.method(replace(method.spec, environment=environment))


def forget() -> None:
    """Forget what was built and hashed: in a session that goes on, files may have changed since."""
    bound.forget()
    for each in (_derived, cases, _batches, environments.facts):
        each.cache_clear()
