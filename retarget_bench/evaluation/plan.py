"""Plans (methods x data sets x splits) and the keys of their results."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal

from retarget_bench.api import SPLITS, CaseInfo, Dataset, Method, Metric, SetMetric, optional
from retarget_bench.api.datasets import DatasetCard
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import clips
from retarget_bench.evaluation.attempt import attempt
from retarget_bench.evaluation.batches import RULE, batches
from retarget_bench.evaluation.cases import listed
from retarget_bench.evaluation.prediction import environments
from retarget_bench.evaluation.score import BASE, declared_values
from retarget_bench.evaluation.tasks import RETARGET, derive
from retarget_bench.files import slug
from retarget_bench.motion.character import Character
from retarget_bench.plugins import assets, registry
from retarget_bench.plugins.code_hash import code_hash, folder_hash, imports, package_code, reached_code
from retarget_bench.plugins.parameters import class_card
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store

Redo = Literal["never", "missing", "failed", "always"]
Stage = Literal["run", "predict", "score"]

MOST = 1e9
"""No limit in seconds or gigabytes is as large."""
OWN_CASES = (RETARGET, "probe")
"""Tasks whose cases are the data set's own."""
LAYERS, FEATURES = "training.layers", "training.features"
"""Packages that plug-ins share: layers of learned methods, networks for features of set metrics."""
SETS = "evaluation.set_metrics"
"""The package that draws sets and evaluates metrics of them."""
APART = ("motion/files/", "motion/editing/")
"""Of ``motion/``, what no method reaches: formats of files, and edits around methods."""


@dataclass(frozen=True)
class Plan:
    """A request. Plain data throughout: it travels to worker processes.

    task:     ``retarget``, or a derived one with its parameters (``denoise[levels=5]``).
    stage:    predict only, score only, or both.
    redo:     never: compute nothing; missing: what is missing or was made by other code, data or
              parameters; failed: also what failed; always: everything.
    external: a folder of predictions made elsewhere, to be scored under the name ``methods[0]``.
    seeds:    stochastic methods run with so many seeds, from ``seed`` on; others with the first alone.
    timeout:  seconds in which a method answers a case; 0: a minute, and a second for each frame.
    memory:   gigabytes that a method may take; 0: as the machine has.
    clips:    patterns of the clips that are asked for, see ``clips.py``; none: all.
    limit:    at most so many clips of each split are asked for; 0: all.
    executor: where the missing cases are computed: ``local``, or one of ``evaluation/executors``.
    """

    methods: tuple[Spec, ...]
    datasets: tuple[Spec, ...]
    splits: tuple[str, ...] = SPLITS
    metrics: tuple[str, ...] = ()
    task: str = RETARGET
    root: Path = Path("runs")
    seed: int = 0
    seeds: int = 1
    jobs: int = 1
    stage: Stage = "run"
    redo: Redo = "missing"
    external: Path | None = None
    timeout: float = 0.0
    memory: float = 0.0
    clips: tuple[str, ...] = ()
    limit: int = 0
    executor: str = "local"
    plugin_files: tuple[tuple[str, registry.Kind], ...] = field(default_factory=registry.files)


def dataset(spec: Spec, task: str = RETARGET) -> Dataset:
    """The data set, built once per process; of a derived task, what the engine makes of its motion."""
    return _dataset(spec, RETARGET if task in OWN_CASES else task)


@cache
def _dataset(spec: Spec, task: str) -> Dataset:
    if task != RETARGET:
        return derive(_dataset(spec, RETARGET), Spec.parse(task))
    return registry.create("datasets", spec)


@cache
def method(spec: Spec) -> Method:
    """The method, built once per process."""
    return registry.create("methods", spec)


def metrics(names: tuple[str, ...]) -> tuple[Metric, ...]:
    """The metrics of single cases, built once per process; BenchError where two declare one value."""
    return tuple(each for each in _built(names) if not optional.is_set_metric(each))


def set_metrics(names: tuple[str, ...]) -> tuple[SetMetric, ...]:
    """The metrics of sets of cases, likewise."""
    return tuple(each for each in _built(names) if optional.is_set_metric(each))


@cache
def _built(names: tuple[str, ...]) -> tuple[Any, ...]:
    built = tuple(registry.create("metrics", Spec.parse(name)) for name in names)
    declared_values(built)
    return built


@lru_cache(maxsize=16)
def _cases(spec: Spec, task: str, split: str) -> Sequence[CaseInfo]:
    """The cases of a split, which all methods share: there may be a million. Raises BenchError."""
    return listed(dataset(spec, task), Spec.parse(task).name, split)


@lru_cache(maxsize=16)
def _batches(spec: Spec, task: str, split: str, together: bool) -> Sequence[tuple[str, ...]]:
    """Their ids, in batches or one by one."""
    infos = _cases(spec, task, split)
    return batches(infos, dataset(spec, task).characters()) if together else [(i.id,) for i in infos]


@dataclass(frozen=True)
class EvaluationUnit:
    """One method on one split of one data set: a result file and what it is known by.

    seed_number: which of several seeds of a stochastic method this is; ``plan.seed`` is that seed.
    """

    plan: Plan
    dataset: Spec
    split: str
    method: Spec
    seed_number: int = 0

    @property
    def data(self) -> Dataset:
        return dataset(self.dataset, self.plan.task)

    @cached_property
    def infos(self) -> Sequence[CaseInfo]:
        return _cases(self.dataset, self.plan.task, self.split)

    @cached_property
    def asked(self) -> Sequence[CaseInfo]:
        """The cases of the clips that the plan asks for."""
        limits = self.plan.clips, self.plan.limit
        return clips.chosen(self.infos, *limits) if any(limits) else self.infos

    @cached_property
    def built(self) -> Method:
        """The method as it is built here, where it may not answer: what is known of it beforehand."""
        return method(self.method.here)

    @property
    def known_as(self) -> Spec:
        """The method as results know it."""
        return self.method if self.plan.external else spec_by_weights(self.method)

    @cached_property
    def paths(self) -> store.ResultPaths:
        name = self.known_as.slug + (f".seed-{self.seed_number}" if self.seed_number else "")
        task = Spec.parse(self.plan.task).slug
        return store.ResultPaths(self.plan.root, dataset_slug(self.dataset), task, self.split, name)

    @cached_property
    def prediction_facts(self) -> dict[str, Any]:
        """Facts that predictions depend on; ``store.case_key`` adds the case."""
        facts = {
            "method": self.method.name,
            "parameters": dict(self.known_as.parameters),
            "code": folder_hash(self.plan.external) if self.plan.external else code_of(self.method),
            "weights": "" if self.plan.external else optional.weights_hash(self.built),
            "dataset": self.dataset.name,
            "dataset_parameters": without_location(self.dataset),
            "content": self.data.content,
            "task": self.plan.task,
            "split": self.split,
            "seed": self.plan.seed,
        }
        if not self.plan.external and (held := assets.asset_hashes(self.built)):
            facts["assets"] = held
        if self.known_as.posts:
            facts["posts"] = [[post.name, dict(post.parameters)] for post in self.known_as.posts]
        if self.environment:
            facts["environment"] = environments.key_facts(self.environment)
        return facts | ({"batches": RULE} if self.in_batches else {})

    @property
    def environment(self) -> str:
        """Where the method answers, if that is another environment than this one."""
        return "" if self.plan.external else self.method.environment

    @property
    def lock(self) -> str:
        return str(environments.facts(self.environment)["lock"]) if self.environment else ""

    @property
    def in_batches(self) -> bool:
        """True if the method takes several cases at once."""
        return self.plan.external is None and optional.takes_batches(self.built)

    @cached_property
    def batches(self) -> Sequence[tuple[str, ...]]:
        """The ids of all cases, in the batches that the method is asked them in; mostly one by one."""
        together = self.in_batches and self.plan.stage != "score"
        return _batches(self.dataset, self.plan.task, self.split, together)

    @cached_property
    def keys(self) -> dict[str, str]:
        prediction = store.key(self.prediction_facts)
        facts = {"prediction": prediction, "metrics": metric_versions(self.plan.metrics)}
        if self.networks:
            facts["networks"] = self.networks
        return {"prediction_key": prediction, "score_key": store.key(facts)}

    @cached_property
    def networks(self) -> dict[str, dict[str, str]]:
        """Set metric -> target structure -> hash of what makes its features; "" where there is none."""
        asked = set_metrics(self.plan.metrics)
        if not asked:
            return {}
        cast = self.data.characters()
        targets = {cast[name].structure: cast[name] for name in {info.target for info in self.infos}}
        ordered = sorted(targets.items())
        return {each.card.name: {name: _network(each, body) for name, body in ordered} for each in asked}


def evaluation_units(plan: Plan) -> list[EvaluationUnit]:
    """Every unit of a plan. Raises BenchError for unknown splits, methods, data sets, parameters."""
    if unknown := [split for split in plan.splits if split not in SPLITS]:
        raise BenchError(f"unknown split {unknown[0]!r}; splits are {', '.join(SPLITS)}")
    methods = list(plan.methods)
    if not plan.external:  # in canonical form, each once, also where its weights are given by several paths
        canonical = [placed(registry.canonical("methods", each)) for each in methods]
        methods = list({spec_by_weights(each): each for each in canonical}.values())
    found = []
    for spec in dict.fromkeys(registry.canonical("datasets", data) for data in plan.datasets):
        offered = dataset(spec, plan.task).card.splits
        for split in dict.fromkeys(plan.splits):
            if split in offered:
                found += [
                    EvaluationUnit(replace(plan, seed=plan.seed + number), spec, split, each, number)
                    for each in dict.fromkeys(methods)
                    for number in range(_seeds(plan, each))
                ]
    return found


def _seeds(plan: Plan, spec: Spec) -> int:
    """The number of seeds that a method runs with."""
    stochastic = not plan.external and optional.method_card(method(spec.here)).stochastic
    return plan.seeds if stochastic else 1


@cache
def spec_by_weights(spec: Spec) -> Spec:
    """A method with local weights goes by their hash: where they lie does not matter, what they hold does.
    Likewise one with assets, and one of another environment by its lock.

    Raises BenchError where there are no such weights or assets, or no such environment.
    """
    built = method(spec.here)
    weighted = {"weights": built, **optional.stages(built)}
    labels = {
        name: optional.weights_label(each) for name, each in weighted.items() if name in spec.parameters
    }
    known = assets.labelled(spec.with_parameters(**{k: v for k, v in labels.items() if v}), built)
    return replace(known, environment=environments.label(spec.environment)) if spec.environment else known


def placed(spec: Spec) -> Spec:
    """The method with the paths of its environment in full; of its card's one, where none is given.

    Raises BenchError where post-processors follow what is no plug-in there.
    """
    given = spec.environment or optional.method_card(method(spec)).environment
    environment = environments.in_full(given)
    if spec.posts and environments.own_worker(environment):
        raise BenchError(
            f"{spec}: post-processors work where the method does, and {given!r} is without this package"
        )
    return replace(spec, environment=environment)


def located(spec: Spec) -> Spec:
    """The method with the paths of its local weights and assets in full, for processes that work in other
    folders."""
    built, known = method(spec.here), spec_by_weights(spec.here)
    spec = assets.in_full(spec, built)
    found = {}
    for name in ("weights", *optional.stages(built)):
        path = Path(str(value := spec.parameters.get(name, "")))
        if known.parameters.get(name, "") != value and not path.is_absolute() and path.exists():
            found[name] = str(path.resolve())
    return spec.with_parameters(**found)


def located_data(spec: Spec) -> Spec:
    """The data set with the paths of its files in full, likewise."""
    given = {name: str(spec.parameters[name]) for name in locations(spec.name) if name in spec.parameters}
    paths = {name: str(Path(path).resolve()) for name, path in given.items() if Path(path).exists()}
    return spec.with_parameters(**paths)


def _network(metric: SetMetric, target: Character) -> str:
    try:
        return attempt(lambda: str(metric.network(target)), BASE, f"network of {metric.card.name}")
    except BenchError:  # each case will be told
        return ""


@cache
def locations(name: str) -> tuple[str, ...]:
    """The parameters of a data set that say where its files lie, as its card tells."""
    factory = registry.load("datasets", name)
    card = class_card(factory) or dataset(Spec(name)).card
    return tuple(getattr(card, "locations", DatasetCard.locations))


def without_location(spec: Spec) -> dict[str, Any]:
    """The parameters of a data set without those that say where its files lie."""
    return {name: value for name, value in spec.parameters.items() if name not in locations(spec.name)}


def dataset_slug(spec: Spec) -> str:
    """The folder of a data set's results. Where its files lie does not matter, what they hold does."""
    if not spec.parameters:
        return slug(spec.name)
    facts = {"parameters": without_location(spec)}
    if any(name in spec.parameters for name in locations(spec.name)):
        facts["content"] = {"hash": dataset(spec).content}
    return f"{slug(spec.name)}-{store.key(facts)[:8]}"


def forget() -> None:
    """Forget what was built and hashed: in a session that goes on, files may have changed since."""
    hashes = (spec_by_weights, locations, method_code, metric_versions, folder_hash, environments.facts)
    for each in (_dataset, _cases, _batches, method, _built, *hashes):
        each.cache_clear()


# ---------------------------------------------------------------------------------------------- hashes
@cache
def method_code(spec: Spec, stages: tuple[str, ...] = ()) -> str:
    """A hash of the plug-in's own files, of those of its stages and post-processors, of ``motion/`` without
    ``APART``, and of what these files reach of the layers that learned methods share. A data set that
    reads formats of motion files has their code in its own ``content``.

    stages: plug-ins that the method is composed of (``optional.stage_names``). Nothing is imported."""
    own = [file for name in dict.fromkeys((spec.name, *stages)) for file in _own_code("methods", name)]
    own += [file for post in spec.posts for file in _own_code("posts", post.name)]
    motion = (each for each in package_code("motion") if not each[0].startswith(APART))
    layers = reached_code(LAYERS, (path for _, path in own))
    return code_hash([*own, *motion, *layers])


def code_of(spec: Spec) -> str:
    """``method_code`` with the stages that the method has, for which it is built."""
    return method_code(spec, optional.stage_names(method(spec.here)))


@cache
def metric_versions(names: tuple[str, ...]) -> dict[str, str]:
    """Metric name -> ``version+code``; the engine's comparison counts as code of each, the drawing and
    evaluation of sets as code of set metrics, and the feature networks where a metric imports from them."""
    found = {}
    for name, metric in zip(names, _built(names), strict=True):
        own = list(_own_code("metrics", Spec.parse(name).name))
        sets = package_code(SETS) if optional.is_set_metric(metric) else ()
        shared = package_code(FEATURES) if any(imports(path, FEATURES) for _, path in own) else ()
        code = code_hash([*own, *package_code("api.comparison"), *sets, *shared])
        found[metric.card.name] = f"{metric.card.version}+{code}"
    return found


def _own_code(kind: registry.Kind, name: str) -> Iterator[tuple[str, Path]]:
    """A plug-in's own files, under names that do not depend on where the plug-in lies."""
    for relative, path in registry.code_files(kind, name):
        yield f"{kind}/{name}/{relative}", path
