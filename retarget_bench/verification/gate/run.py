"""One run of the gate: measure, compare, and accept the changes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from retarget_bench import defaults
from retarget_bench.api import Metric, SetMetric
from retarget_bench.api.optional import is_set_metric, metric_tasks
from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.bound import declared_values
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.gate import compare, core, frozen, golden, method_rows, report
from retarget_bench.verification.gate.compare import EVERYTHING, Criteria, GateRow, Status
from retarget_bench.verification.gate.golden import Snapshot

Progress = Callable[[int, int], None]
VALUE_FACTS = ("unit", "better", "goal", "tolerance", "index", "with_self")


@dataclass(frozen=True)
class GateOutcome:
    """The result of a check. verdict: 0 same, 1 moved, 2 could not measure."""

    lines: Sequence[GateRow]
    now: Snapshot

    @property
    def verdict(self) -> int:
        return compare.verdict(self.lines)


def check(
    folder: Path,
    methods: Sequence[str],
    dataset: Spec | None,
    progress: Progress,
    *,
    accept: bool = False,
    forget: Sequence[str] = (),
    asked: Criteria = EVERYTHING,
) -> GateOutcome:
    """Measure, and compare with the golden rows in ``folder``, by what is asked for.

    methods: labels; none: those of the golden rows and, where these are of everything, the built-in ones
    that run by default. dataset: None: that of the golden rows. accept: everything that the golden rows
    hold is measured besides, and there may be none yet; forget: but for these methods. Raises BenchError
    where there is none or it is damaged.
    """
    before = golden.read(folder) if golden.exists(folder) else None
    for label in forget:
        if before is None or before.methods.pop(label, None) is None:
            raise BenchError(f"{folder} has no golden rows of {label}, which should be forgotten")
    if before is None and not accept:
        raise BenchError(
            f'{folder} has no golden rows; bench check --accept --because "..." --baseline {folder} makes '
            "them from what is measured now"
        )
    now = measure(folder, before, methods, dataset, accept, progress)
    if before is None:
        before = Snapshot(now.complete, now.dataset, now.smoke, {}, {})
    gone = [GateRow(Status.MOVED, label, why="forgotten") for label in forget]
    return GateOutcome([*gone, *compare.compare(before, now, asked)], now)


def accept(folder: Path, found: GateOutcome, because: str) -> Path:
    """Make what was measured the golden rows, and log it. Returns the log's path.

    Raises BenchError, and then nothing has changed.
    """
    if found.verdict == 2:
        raise BenchError("nothing was accepted: something could not be measured")
    reason = " ".join(because.split())
    return golden.write(folder, found.now, f"{report.moved(found.lines)}. Because: {reason}")


def measure(
    folder: Path,
    before: Snapshot | None,
    methods: Sequence[str],
    dataset: Spec | None,
    accept: bool,
    progress: Progress,
) -> Snapshot:
    """All that ``check`` compares. What cannot be measured is named in ``missing``; the rest goes on."""
    labels = [str(Spec.parse(each)) for each in methods]
    complete = before.complete if before is not None else not labels
    everything = accept or not labels
    if before is not None and everything:
        labels += before.methods
    if complete and everything:
        labels += method_rows.default_methods()
    data = dataset or Spec.parse(before.dataset["spec"] if before is not None else defaults.DATASET)
    partial = before is not None and not complete and not accept
    missing: list[str] = []
    names = tuple(before.metrics) if partial and before is not None else own_metrics()
    metrics = built_metrics(names, missing)
    found = Snapshot(
        complete=complete and everything,
        dataset={},
        smoke={},
        metrics={metric.card.name: str(metric.card.version) for metric in metrics},
        values=value_facts(metrics),
        missing=missing,
    )
    if found.complete:
        # the frozen motions beside the golden rows where these have some, else those of the package
        beside = folder if (folder / golden.MOTIONS).is_dir() else golden.built_in()
        try:
            frozen.measure(found, beside, metrics, progress)
            core.measure(found, beside)
        except BenchError as error:
            missing.append(str(error))
        if not found.motions:
            missing.append(f"{beside / golden.MOTIONS} has no frozen motion")
    # the cases of the golden rows, unless the data set says itself that it holds something else now
    same = before is not None and before.dataset.get("content") == bound.dataset(data).built.content
    wanted = before.smoke if same and before is not None else None
    scoring = tuple(metric.card.name for metric in metrics if not is_set_metric(metric))
    method_rows.measure(found, data, wanted, list(dict.fromkeys(labels)), scoring, progress)
    return found


def built_metrics(names: Sequence[str], missing: list[str]) -> tuple[Metric | SetMetric, ...]:
    """The metrics that can be built; the others are missing."""
    kept: list[Metric | SetMetric] = []
    for name in names:
        try:
            metric = registry.create("metrics", name)
            declared_values([*kept, metric])
        except BenchError as error:
            missing.append(str(error))
            continue
        kept.append(metric)
    return tuple(kept)


def value_facts(metrics: Sequence[Metric | SetMetric]) -> dict[str, dict[str, Any]]:
    """Value id -> the facts that its numbers depend on, and its metric."""
    return {
        value.id: {"metric": metric.card.name} | {name: getattr(value, name) for name in VALUE_FACTS}
        for metric in metrics
        for value in metric.card.computed
    }


def own_metrics() -> tuple[str, ...]:
    """The built-in metrics and those of ``--plugin`` files; what else is installed does not matter, nor do
    those of derived tasks, which no case here is of."""
    own = (registry.BUILT_IN, *(path for path, _ in registry.files()))
    return tuple(e.name for e in registry.names("metrics") if e.origin in own and _retargets(e.name))


def _retargets(name: str) -> bool:
    """True for a metric of retargeting; one that cannot be built counts, so that it is reported."""
    try:
        return "retarget" in metric_tasks(registry.create("metrics", name))
    except BenchError:
        return True
