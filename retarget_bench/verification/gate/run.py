"""One run of the gate: measure what golden rows hold, compare, and accept the changes."""

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from retarget_bench import defaults
from retarget_bench.api import AnyMetric, SetMetric
from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.bound import declared_values
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.gate import compare, core, frozen, golden, method_rows
from retarget_bench.verification.gate.compare import EVERYTHING, Comparison, Criteria
from retarget_bench.verification.gate.golden import Measured

Progress = Callable[[int, int], None]


def check(
    folder: Path,
    scratch: Path,
    methods: Sequence[str],
    dataset: Spec | None,
    progress: Progress,
    *,
    accept: bool = False,
    criteria: Criteria = EVERYTHING,
) -> tuple[Comparison, Measured]:
    """Measure, and compare with the golden rows in ``folder``, by these criteria.

    scratch: an empty folder for the rows of methods. methods: labels; none: those of the golden rows.
    dataset: None: that of the golden rows. accept: all that the golden rows hold is measured besides, and
    where they are of everything also the built-in methods that run by default; there may be none yet.
    What cannot be measured is named in ``missing``; the rest goes on. Raises BenchError where there are no
    golden rows, or these are damaged.
    """
    before = golden.read(folder)
    fresh, labels = not before.facts, [str(Spec.parse(each)) for each in methods]
    if fresh and not accept:
        raise BenchError(
            f'{folder} has no golden rows; bench check -r {folder} --accept "why" makes '
            "them from what is measured now"
        )
    everything = accept or not labels
    complete = before.complete or (fresh and not labels)
    labels += before.under("weights") if everything else ()
    labels += method_rows.default_methods() if complete and accept else ()
    now = Measured(scratch / golden.ROWS)
    # golden rows of one's own methods leave metrics alone that they do not know
    metrics = built_metrics(own_metrics() if complete or accept else [*before.under("metric")], now)
    if complete and everything:
        # the frozen motions beside the golden rows where these have some, else those of the package
        own = (folder / golden.MOTIONS).is_dir()
        measure_frozen(now, folder if own else golden.built_in(), metrics, progress)
    data = bound.dataset(dataset or Spec.parse(before.facts.get("dataset/spec", defaults.DATASET)))
    scoring = tuple(metric.card.name for metric in metrics if not isinstance(metric, SetMetric))
    method_rows.measure(now, before, data, list(dict.fromkeys(labels)), scoring, progress)
    return compare.compare(before, now, criteria), now


def measure_frozen(now: Measured, folder: Path, metrics: Sequence[AnyMetric], progress: Progress) -> None:
    """Add the values of frozen motions, and the facts of the core on frozen inputs."""
    try:
        frozen.measure(now, folder, metrics, progress)
        core.measure(now, folder)
    except BenchError as error:
        now.missing.append(str(error))


def accept(folder: Path, comparison: Comparison, now: Measured, because: str) -> Path:
    """Make what was measured the golden rows, and log it. Returns the log's path.

    Raises BenchError, and then nothing has changed.
    """
    if comparison.verdict == 2:
        raise BenchError("nothing was accepted: something could not be measured")
    counted = Counter((each.subject, str(each.status)) for each in comparison.changes).most_common(8)
    moved = ", ".join(f"{subject} ({number} {status})" for (subject, status), number in counted)
    return golden.accept(folder, now, f"{moved}. Because: {' '.join(because.split())}")


# -------------------------------------------------------------------------------------------- metrics
def built_metrics(names: Sequence[str], now: Measured) -> tuple[AnyMetric, ...]:
    """The metrics of retargeting that can be built, with their protocol facts; those that cannot be built
    are missing."""
    metrics: list[AnyMetric] = []
    for name in names:
        try:
            metric = registry.create("metrics", name)
            if method_rows.TASK not in metric.card.tasks:
                continue
            declared_values([*metrics, metric])
        except BenchError as error:
            now.missing.append(str(error))
            continue
        metrics.append(metric)
        declare(now, metric)
    return tuple(metrics)


def declare(now: Measured, metric: AnyMetric) -> None:
    """Add the protocol facts of a metric: its version, and the declarations of its values."""
    name = metric.card.name
    now.facts[f"metric/{name}"] = f"version {metric.card.version}"
    for value in metric.card.computed:
        pooled = ", with self pairs" if value.with_self else ""
        index = f", per {value.index}" if value.index else ""
        now.facts[f"value/{value.id}"] = (
            f"{name}: unit {value.unit}, better {value.better}, goal {value.goal:g}, tolerance "
            f"{value.tolerance:g}{index}{pooled}"
        )


def own_metrics() -> list[str]:
    """The built-in metrics and those of plug-ins' files; other installed ones do not count."""
    own = (registry.BUILT_IN, *(path for path, _ in registry.files()))
    return [entry.name for entry in registry.names("metrics") if entry.origin in own]
