"""Plug-ins bound to their parameters: a text is parsed once, and the bound object is passed on.

    method("pan[weights=mine]+footlock").built.retarget(...)

A bound plug-in is the same object for the same text as long as the process lives. It is built when it
is first used, and knows what its results depend on and what they call it.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from retarget_bench.api import AnyMetric, Dataset, Method, MethodCard, Metric, PairMetric, SetMetric, Value
from retarget_bench.api.completing import whole
from retarget_bench.api.datasets import DatasetCard
from retarget_bench.errors import BenchError
from retarget_bench.files import facts_digest, slug
from retarget_bench.plugins import assets, registry
from retarget_bench.plugins.code_hash import code_hash, folder_hash, package_code, reached
from retarget_bench.plugins.parameters import class_card
from retarget_bench.plugins.spec import Spec

LAYERS = "training.layers"
"""The package that plug-ins share: layers of learned methods."""
SETS, PAIRS = "evaluation.set_metrics", "evaluation.pairs"
"""What evaluates metrics of sets and of pairs of bodies."""
APART = ("motion.files", "motion.editing")
"""Of ``motion/``, what no method reaches: formats of files, and edits around methods."""


def stages_fault(method: Method) -> str:
    """Why the methods that a method is composed of cannot be read; "" where they can."""
    try:
        stages: object = method.stages
    except Exception as error:  # the plug-in's own code
        return f"its stages cannot be read: {error!r}"
    return "" if isinstance(stages, Mapping) else f"its stages are no methods by name, but {stages!r}"


@dataclass(frozen=True)
class BoundMethod:
    """A method with its post-processors. spec: in canonical form."""

    spec: Spec

    @cached_property
    def built(self) -> Method:
        """The plug-in object as it is built here, also where it answers in another environment.

        Raises BenchError.
        """
        method: Method = registry.create("methods", self.spec.here)
        if fault := stages_fault(method):
            raise BenchError(f"{self.spec}: {fault}")
        return method

    @cached_property
    def card(self) -> MethodCard:
        return self.built.card

    @cached_property
    def _labels(self) -> dict[str, str]:
        """Parameter that names local weights or assets -> the hash that it goes by in results.

        Raises BenchError where these are missing."""
        weighted, values = {"weights": self.built, **self.built.stages}, self.spec.parameters
        labels = {name: each.weights_label for name, each in weighted.items() if name in values}
        for name in self.card.assets:
            if name in values:
                labels[name] = f"local-{assets.asset_hash(assets.asset_path(self.built, name))[:8]}"
        return {name: label for name, label in labels.items() if label not in ("", values[name])}

    @property
    def known_as(self) -> Spec:
        """The spec in results: local weights and assets go by their hash, since where they lie does not
        matter, but what they hold does. Raises BenchError where there are none."""
        return self.spec.with_parameters(**self._labels)

    @property
    def folders(self) -> dict[str, str]:
        """Parameter that names local weights or assets -> the last folder, or the file, where they lie."""
        local = [name for name, label in self._labels.items() if label.startswith("local-")]
        paths = {name: Path(str(self.spec.parameters[name])).expanduser().absolute() for name in local}
        return {n: path.parent.name if path.stem == "weights" else path.stem for n, path in paths.items()}

    @property
    def located(self) -> Spec:
        """The spec with the paths of local weights and assets in full, for processes that work in other
        folders. Raises BenchError where there are none."""
        paths = {name: Path(str(self.spec.parameters[name])).expanduser() for name in self._labels}
        full = {name: str(path.absolute()) for name, path in paths.items() if path.exists()}
        return self.spec.with_parameters(**full)

    @property
    def code(self) -> str:
        """A hash of the code that its answers depend on."""
        return method_code(self.spec, stage_names(self.built))


@dataclass(frozen=True)
class BoundDataset:
    """A data set. spec: in canonical form."""

    spec: Spec

    @cached_property
    def built(self) -> Dataset:
        """The plug-in object. Raises BenchError."""
        data: Dataset = registry.create("datasets", self.spec)
        return data

    @cached_property
    def locations(self) -> tuple[str, ...]:
        """The parameters that say where its files lie, as its card tells."""
        card = class_card(registry.load("datasets", self.spec.name))
        return tuple(whole(card or dataset(Spec(self.spec.name)).built.card, DatasetCard).locations)

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters without those that say where its files lie."""
        return {name: each for name, each in self.spec.parameters.items() if name not in self.locations}

    @cached_property
    def located(self) -> Spec:
        """The spec with the paths of its files in full, for processes that work in other folders."""
        places = {n: str(self.spec.parameters[n]) for n in self.locations if n in self.spec.parameters}
        paths = {name: str(Path(path).resolve()) for name, path in places.items() if Path(path).exists()}
        return self.spec.with_parameters(**paths)

    @cached_property
    def slug(self) -> str:
        """The folder of its results. Where its files lie does not matter, what they hold does."""
        if not self.spec.parameters:
            return slug(self.spec.name)
        facts: dict[str, Any] = {"parameters": self.parameters}
        if any(name in self.spec.parameters for name in self.locations):
            facts["content"] = {"hash": self.built.content}
        return f"{slug(self.spec.name)}-{facts_digest(facts)[:8]}"


@dataclass(frozen=True)
class BoundMetrics:
    """Some metrics that are computed together; no two of them declare one value."""

    names: tuple[str, ...]

    @cached_property
    def built(self) -> tuple[Any, ...]:
        """The plug-in objects. Raises BenchError."""
        built = tuple(registry.create("metrics", Spec.parse(name)) for name in self.names)
        for metric in built:
            if isinstance(metric, PairMetric) and not (isinstance(metric.least, int) and metric.least >= 1):
                name = metric.card.name
                raise BenchError(
                    f"metric {name}: least, the fewest clips of a pair, must be a whole number, 1 or more"
                )
        declared_values(built)
        return built

    @cached_property
    def of_cases(self) -> tuple[Metric, ...]:
        """The metrics of single cases."""
        return tuple(each for each in self.built if isinstance(each, Metric))

    @cached_property
    def of_pairs(self) -> tuple[PairMetric, ...]:
        """The metrics of all clips of a pair of bodies together."""
        return tuple(each for each in self.built if isinstance(each, PairMetric))

    @cached_property
    def of_sets(self) -> tuple[SetMetric, ...]:
        """The metrics of whole sets of cases."""
        return tuple(each for each in self.built if isinstance(each, SetMetric))

    @property
    def wait(self) -> bool:
        """Whether any of them keeps something of each case until all are answered."""
        return bool(self.of_pairs or self.of_sets)

    @cached_property
    def versions(self) -> dict[str, str]:
        """Metric name -> ``version+code``, and a hash of its parameters. The engine's comparison counts as
        code of each, and the evaluation of sets and pairs as code of their metrics."""
        versions = {}
        for name, metric in zip(self.names, self.built, strict=True):
            spec = Spec.parse(name)
            files = registry.code_files("metrics", spec.name) | package_code("api.comparison")
            if isinstance(metric, SetMetric):
                files |= package_code(SETS)
            if isinstance(metric, PairMetric):
                files |= package_code(PAIRS)
            chosen = f" {facts_digest(spec.parameters)[:8]}" if spec.parameters else ""
            versions[metric.card.name] = f"{metric.card.version}+{code_hash(files)}{chosen}"
        return versions


# --------------------------------------------------------------------------------------------- binding
def method(spec: Spec | str) -> BoundMethod:
    """The bound method of a text, or of a spec that was read. Raises BenchError."""
    return _method(registry.canonical("methods", spec))


def dataset(spec: Spec | str) -> BoundDataset:
    """The bound data set of a text, or of a spec that was read. Raises BenchError."""
    return _dataset(registry.canonical("datasets", spec))


@cache
def metrics(names: tuple[str, ...]) -> BoundMetrics:
    """Bound metrics by their names."""
    return BoundMetrics(names)


@cache
def _method(spec: Spec) -> BoundMethod:
    return BoundMethod(spec)


@cache
def _dataset(spec: Spec) -> BoundDataset:
    return BoundDataset(spec)


def forget() -> None:
    """Forget what was built and hashed: in a session that goes on, files may have changed since."""
    for each in (_method, _dataset, metrics, method_code, folder_hash):
        each.cache_clear()


# ---------------------------------------------------------------------------------------------- hashes
@cache
def method_code(spec: Spec, stages: tuple[str, ...] = ()) -> str:
    """A hash of the plug-in's own files, of those of its stages and post-processors, of ``motion/`` without
    ``APART``, and of what these files reach of the layers that learned methods share. A data set that
    reads formats of motion files has their code in its own ``content``.

    stages: plug-ins that the method is composed of (``stage_names``). Nothing is imported."""
    own = set().union(*(registry.code_files("methods", name) for name in (spec.name, *stages)))
    own = own.union(*(registry.code_files("posts", post.name) for post in spec.posts))
    return code_hash(reached(own, LAYERS) | package_code("motion").difference(*map(package_code, APART)))


def stage_names(method: Method) -> tuple[str, ...]:
    """The plug-ins that a method is composed of, and those that these are composed of."""
    return tuple(name for one in method.stages.values() for name in (one.card.name, *stage_names(one)))


def declared_values(metrics: Iterable[AnyMetric]) -> dict[str, Value]:
    """Value id -> its declaration. Raises BenchError where two metrics use the same id."""
    declared: dict[str, tuple[str, Value]] = {}
    for metric in metrics:
        for value in metric.card.computed:
            if value.id in declared:
                raise BenchError(
                    f"metrics {declared[value.id][0]!r} and {metric.card.name!r} both declare {value.id!r}"
                )
            declared[value.id] = metric.card.name, value
    return {value_id: value for value_id, (_, value) in declared.items()}
