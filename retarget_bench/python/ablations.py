"""``bench ablate``: trains the rows of an ablation under one budget, runs them, and makes the table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from retarget_bench.analysis.selection import Selection
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.tables.model import Table
from retarget_bench.tables.published.joined import joined
from retarget_bench.tables.published.printed import PublishedTable, of_rows
from retarget_bench.training.ablation import Ablation
from retarget_bench.training.train import ProgressReporter, TrainingOptions, finished, train

TASK = "retarget"
DECIMALS = 4
"""Of our numbers: one more than papers print, since rows of one method differ by little."""


@dataclass(frozen=True)
class TrainedRow:
    """A row of an ablation by its label. ready: the method with the weights that were trained for it."""

    label: str
    ready: Spec


def find(method: Spec, name: str) -> Ablation:
    """A method's ablation by name.

    Raises BenchError, with those that there are, or where the method already says what rows change.
    """
    if method.posts:
        raise BenchError(f"{method}: post-processors have no part in an ablation; ablate {method.alone}")
    offered: Mapping[str, Ablation] = getattr(bound.method(method).built, "ablations", {})
    if not offered:
        raise BenchError(f"{method.name} offers no ablation")
    if name not in offered:
        known = ", ".join(f"{each} ({found.title})" for each, found in offered.items())
        raise BenchError(f"{method.name} has no ablation {name!r}; there are {known}")
    changed = {parameter for parameters in offered[name].rows.values() for parameter in parameters}
    if given := sorted(changed & set(method.parameters)):
        raise BenchError(f"{method}: {' and '.join(given)} is what rows of {name} change; leave it out")
    return offered[name]


def published(ablation: Ablation) -> PublishedTable:
    """The rows of an ablation as printed, in the columns that any data can fill."""
    return of_rows(ablation.tables, ablation.rows, ablation.title, ablation.notes, DECIMALS)


def check(ablation: Ablation, data: Spec) -> None:
    """Check for what would stand in the way once all is trained.

    Raises BenchError where no metric has a column's value, or the data set to test on no case for a column.
    """
    _metrics(ablation)
    tested = bound.dataset(data).built
    for cases, column in {column.cases: column for column in published(ablation).columns}.items():
        there = [split for split in tested.card.splits if column.takes(split)]
        if not any(tested.cases(TASK, split) for split in there):
            raise BenchError(
                f"{tested.label.strip()} has no case of {cases}, and rows are measured on such; name "
                "another data set by --test"
            )


def train_rows(
    ablation: Ablation, asked: TrainingOptions, out: Path, reporter: ProgressReporter
) -> list[TrainedRow]:
    """Weights for every row, under the same data, seed, preset and budget.

    asked: what all rows have in common; its method is the one that rows change. A row that is trained is
    left as it is, one that was interrupted goes on. Raises BenchError where a folder holds another run.
    """
    assert asked.method is not None
    made = []
    for row, parameters in ablation.rows.items():
        spec = registry.canonical("methods", asked.method.with_parameters(**parameters))
        mine = replace(asked, method=spec, out=out / "train" / spec.slug, resume=True)
        if finished(mine):
            reporter.say(f"{row}: trained already ({mine.out})")
        else:
            reporter.say(f"{row}: training {spec}")
            train(mine, reporter)
        ready = registry.canonical("methods", spec.with_parameters(weights=str(mine.out)))
        made.append(TrainedRow(row, ready))
    return made


def plan_of(
    ablation: Ablation, trained: Sequence[TrainedRow], data: Spec, out: Path, jobs: int
) -> plan.Plan:
    """The plan of predictions and scores on the data set to test on. Raises BenchError; see ``check``."""
    there = bound.dataset(data).built.card.splits
    asked = published(ablation).columns
    return plan.Plan(
        methods=tuple(dict.fromkeys(each.ready for each in trained)),
        datasets=(data,),
        splits=tuple(split for split in there if any(column.takes(split) for column in asked)),
        metrics=_metrics(ablation),
        task=TASK,
        out=out,
        jobs=jobs,
    )


def _metrics(ablation: Ablation) -> tuple[str, ...]:
    """Names of the metrics that compute the columns. Raises BenchError where there is none."""
    wanted = {column.value_id for column in published(ablation).columns}
    found, _ = registry.working("metrics")
    names = {value.id: name for name, each in found.items() for value in each.card.values}
    if unknown := sorted(wanted - set(names)):
        raise BenchError(f"no metric computes {', '.join(unknown)}")
    return tuple(sorted({names[value] for value in wanted}))


def table(
    ablation: Ablation, trained: Sequence[TrainedRow], carried_out: plan.Plan, trained_on: str, recipe: str
) -> Table:
    """Every printed row, and below it the one that was trained here, from the results of a plan.

    trained_on: label of the training data. recipe: of every row.
    """
    rows = {bound.method(each.ready).known_as: each.label for each in trained}
    units = plan.evaluation_units(carried_out)
    known_as = {store.read_header(unit.paths.header).method.label: rows[unit.known_as] for unit in units}
    made = joined(
        published(ablation), [unit.paths for unit in units], Selection(variants=True), known_as=known_as
    )
    (tested,) = (bound.dataset(each).built.label.strip() for each in carried_out.datasets)
    how = f"Every row of ours: {recipe}, trained on {trained_on}, tested on {tested}"
    told = f"{how}. How rows differ can be compared with the paper, the numbers cannot."
    return replace(made, notes=(told, *made.notes))
