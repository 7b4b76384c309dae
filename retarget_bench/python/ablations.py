"""Ablations: train the rows under one budget, run them, and make the table."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from retarget_bench import defaults
from retarget_bench.analysis.selection import Selection
from retarget_bench.api import Ablation
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.tables.model import Table
from retarget_bench.tables.published.joined import joined
from retarget_bench.tables.published.printed import PublishedTable, of_rows
from retarget_bench.training import run_folder
from retarget_bench.training.train import (
    ProgressReporter,
    TrainingOptions,
    contradicted,
    finished,
    train,
)

DECIMALS = 4
"""Of our numbers: one more than papers print, since rows of one method differ by little."""


def find(method: Spec, name: str) -> Ablation:
    """A method's ablation by name.

    Raises BenchError, with those that there are, or where the method already says what rows change.
    """
    if method.posts:
        raise BenchError(f"{method}: post-processors have no part in an ablation; ablate {method.alone}")
    offered = bound.method(method).built.ablations
    if not offered:
        raise BenchError(f"{method.name} offers no ablation")
    if name not in offered:
        names = ", ".join(f"{each} ({ablation.title})" for each, ablation in offered.items())
        raise BenchError(f"{method.name} has no ablation {name!r}; there are {names}")
    if not offered[name].rows:
        raise BenchError(f"the ablation {name} of {method.name} has no rows")
    changed = {parameter for parameters in offered[name].rows.values() for parameter in parameters}
    if stated := sorted(changed & set(method.parameters)):
        raise BenchError(f"{method}: {' and '.join(stated)} is what rows of {name} change; leave it out")
    return offered[name]


def published(ablation: Ablation) -> PublishedTable:
    """The rows of an ablation as printed, in the columns that any data can fill."""
    return of_rows(ablation.tables, ablation.rows, ablation.title, ablation.notes, DECIMALS)


def check(ablation: Ablation, data: Spec) -> None:
    """Check before training that the table can be made.

    Raises BenchError where no metric has a column's value, or the data set to test on no case for a column.
    """
    _metrics(ablation)
    tested = bound.dataset(data).built
    for cases, column in {column.cases: column for column in published(ablation).columns}.items():
        there = [split for split in tested.card.splits if column.takes(split)]
        if not any(tested.cases(defaults.TASK, split) for split in there):
            raise BenchError(
                f"{tested.label.strip()} has no case of {cases}, and rows are measured on such; name "
                "another data set by --test"
            )


def train_rows(
    ablation: Ablation, shared: TrainingOptions, out: Path, reporter: ProgressReporter
) -> dict[str, Spec]:
    """Label of every row -> the method with weights for it, all under the same data, seed, preset, budget.

    shared: what all rows have in common; its method is the one that rows change. A row that is trained is
    left as it is, one that was interrupted goes on. Raises BenchError where a folder holds another run.
    """
    assert shared.method is not None
    trained = {}
    for label, parameters in ablation.rows.items():
        spec = registry.canonical("methods", shared.method.with_parameters(**parameters))
        options = replace(shared, method=spec, out=out / "train" / spec.slug, resume=True)
        assert options.out is not None
        earlier = run_folder.read(options.out)
        if earlier is not None:  # under a longer budget a row would go on, and the others not
            contradicted("budget", earlier.budget, shared.budget)
        if finished(options):
            reporter.say(f"{label}: trained already ({options.out})")
        else:
            reporter.say(f"{label}: training {spec}")
            train(options, reporter)
        trained[label] = registry.canonical("methods", spec.with_parameters(weights=str(options.out)))
    return trained


def plan_of(ablation: Ablation, trained: Mapping[str, Spec], data: Spec, out: Path, jobs: int) -> plan.Plan:
    """The plan of predictions and scores on the data set to test on. Raises BenchError; see ``check``."""
    splits, columns = bound.dataset(data).built.card.splits, published(ablation).columns
    return plan.Plan(
        methods=tuple(dict.fromkeys(trained.values())),
        datasets=(data,),
        splits=tuple(split for split in splits if any(column.takes(split) for column in columns)),
        metrics=_metrics(ablation),
        task=defaults.TASK,
        out=out,
        jobs=jobs,
    )


def _metrics(ablation: Ablation) -> tuple[str, ...]:
    """Names of the metrics that compute the columns. Raises BenchError where there is none."""
    value_ids = {column.value_id for column in published(ablation).columns}
    metrics, _ = registry.working("metrics")
    names = {value.id: name for name, metric in metrics.items() for value in metric.card.values}
    if unknown := sorted(value_ids - set(names)):
        raise BenchError(f"no metric computes {', '.join(unknown)}")
    return tuple(sorted({names[value] for value in value_ids}))


def table(
    ablation: Ablation,
    trained: Mapping[str, Spec],
    carried_out: plan.Plan,
    trained_on: str,
    recipe: str,
) -> Table:
    """Every printed row, and below it the one that was trained here, from the results of a plan.

    trained_on: label of the training data. recipe: of every row, in words.
    """
    rows = {bound.method(spec).known_as: label for label, spec in trained.items()}
    units = plan.evaluation_units(carried_out)
    known_as = {store.read_header(unit.paths.header).method.shown: rows[unit.known_as] for unit in units}
    paths = [unit.paths for unit in units]
    result = joined(published(ablation), paths, Selection(variants=True), known_as=known_as)
    (tested_on,) = (bound.dataset(each).built.label.strip() for each in carried_out.datasets)
    note = (
        f"Every row of ours: {recipe}, trained on {trained_on}, tested on {tested_on}. How rows differ can "
        "be compared with the paper, the numbers cannot."
    )
    return replace(result, notes=(note, *result.notes))
