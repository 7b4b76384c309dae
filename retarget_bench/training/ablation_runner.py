"""``bench ablate``: trains the rows of an ablation under one budget, runs them, and makes the table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from retarget_bench.analysis.summary import means_over_clips
from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import columns, compatibility, metres, store
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables.model import EMPTY, FAILED, Cell, Footnotes, Group, Table, count
from retarget_bench.tables.model import Column as Heading
from retarget_bench.tables.model import Row as Line
from retarget_bench.training.ablation import Ablation, AblationColumn, AblationRow
from retarget_bench.training.train import ProgressReporter, TrainingOptions, finished, train

TASK = "retarget"
PRINTED = "printed"
DECIMALS = 4
"""Of our numbers: one more than papers print, since rows of one method differ by little."""

Numbers = Mapping[str, Mapping[CaseInfo, float]]
"""Value id -> case -> number."""


@dataclass(frozen=True)
class TrainedRow:
    """A row of an ablation. method: as it was trained. ready: the same with the weights."""

    row: AblationRow
    method: Spec
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
    changed = {parameter for row in offered[name].rows for parameter in row.parameters}
    if given := sorted(changed & set(method.parameters)):
        raise BenchError(f"{method}: {' and '.join(given)} is what rows of {name} change; leave it out")
    return offered[name]


def check(ablation: Ablation, data: Spec) -> None:
    """Check for what would stand in the way once all is trained.

    Raises BenchError where no metric has a column's value, or the data set to test on no case for a column.
    """
    _metrics(ablation)
    tested = bound.dataset(data).built
    for splits in dict.fromkeys(column.splits for column in ablation.columns if column.value):
        offered = [split for split in splits if split in tested.card.splits]
        if not any(tested.cases(TASK, split) for split in offered):
            raise BenchError(
                f"{tested.label.strip()} has no {' or '.join(splits)} case, and rows are measured on such; "
                "name another data set by --test"
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
    for row in ablation.rows:
        spec = registry.canonical("methods", asked.method.with_parameters(**row.parameters))
        mine = replace(asked, method=spec, out=out / "train" / spec.slug, resume=True)
        if finished(mine):
            reporter.say(f"{row.label}: trained already ({mine.out})")
        else:
            reporter.say(f"{row.label}: training {spec}")
            train(mine, reporter)
        ready = registry.canonical("methods", spec.with_parameters(weights=str(mine.out)))
        made.append(TrainedRow(row, spec, ready))
    return made


def plan_of(
    ablation: Ablation, trained: Sequence[TrainedRow], data: Spec, out: Path, jobs: int
) -> plan.Plan:
    """The plan of predictions and scores on the data set to test on. Raises BenchError; see ``check``."""
    there = bound.dataset(data).built.card.splits
    asked = {split for column in ablation.columns for split in column.splits}
    return plan.Plan(
        methods=tuple(dict.fromkeys(each.ready for each in trained)),
        datasets=(data,),
        splits=tuple(split for split in there if split in asked),
        metrics=_metrics(ablation),
        task=TASK,
        root=out,
        jobs=jobs,
    )


def _metrics(ablation: Ablation) -> tuple[str, ...]:
    """Names of the metrics that compute the columns. Raises BenchError where there is none."""
    wanted = {column.value for column in ablation.columns if column.value}
    found, _ = registry.working("metrics")
    names = {value.id: name for name, each in found.items() for value in each.card.values}
    if unknown := sorted(wanted - set(names)):
        raise BenchError(f"no metric computes {', '.join(unknown)}")
    return tuple(sorted({names[value] for value in wanted}))


def numbers_of(ablation: Ablation, asked: plan.Plan, trained: Sequence[TrainedRow]) -> list[Numbers]:
    """Scores of every row in the units of the columns, from the results of a plan that was carried out."""
    places: dict[Spec, list[ResultPaths]] = {}
    for unit in plan.evaluation_units(asked):
        places.setdefault(unit.known_as, []).append(unit.paths)
    return [_numbers(places[bound.method(each.ready).known_as], ablation) for each in trained]


def _numbers(places: Sequence[ResultPaths], ablation: Ablation) -> Numbers:
    units = {column.value: column.unit for column in ablation.columns}
    headers = [store.read_header(place.header) for place in places]
    newest = compatibility.newest(headers)
    found: dict[str, dict[CaseInfo, float]] = {}
    for place, header in zip(places, headers, strict=True):
        part = columns.read(place, header, newest)
        for (value, index), column in part.numbers.items():
            if value in units and not index:
                if metres.UNITS.get(header.values[value].unit) == units[value]:
                    column = column * metres.per_cent([place], part.cases)
                there = zip(part.cases, column.tolist(), strict=True)
                found.setdefault(value, {}).update({c: x for c, x in there if not np.isnan(x)})
    return found


# ------------------------------------------------------------------------------------------ the table
def table(
    ablation: Ablation,
    trained: Sequence[TrainedRow],
    found: Sequence[Numbers],
    trained_on: str,
    tested_on: str,
    recipe: str,
) -> Table:
    """Every row twice where it is printed: so, and as it came out here.

    Ours are means over clips of means per clip, over the cases that all rows have a number for.
    trained_on, tested_on: labels of data sets. recipe: of every row.
    """
    footnotes = Footnotes()
    common = [_common(column, found) for column in ablation.columns]
    lines = []
    for each, numbers in zip(trained, found, strict=True):
        if each.row.printed:
            printed = tuple(_printed(each.row.printed.get(c.label), footnotes) for c in ablation.columns)
            lines.append(Line(f"{each.row.label} ({PRINTED})", "", printed, ""))
        cells = tuple(
            _cell(column, numbers, cases, footnotes)
            for column, cases in zip(ablation.columns, common, strict=True)
        )
        # columns may be over different splits
        n = ", ".join(dict.fromkeys(str(cell.n) for cell in cells if cell.value is not None)) or "0"
        lines.append(Line(each.row.label, "", cells, n, str(each.method)))
    group = Group(
        title=ablation.paper,
        split="",
        columns=tuple(_heading(column) for column in ablation.columns),
        ranked=tuple(lines),
        unranked=(),
        heading="row",
    )
    made = f"trained here on {trained_on} and run on {tested_on}"
    if trained_on == tested_on:
        made = f"trained and run here, on {tested_on}"
    return Table(
        title=ablation.title,
        groups=(group,),
        notes=(
            f"Every row: {recipe}, trained on {trained_on}, tested on {tested_on}.",
            *_counts(ablation, common, tested_on),
            *ablation.notes,
        ),
        footnotes=tuple(footnotes.sentences),
        reading=f"Rows marked '{PRINTED}' are the paper's numbers, on the paper's data; the row under each "
        f"was {made}: how rows differ can be compared, the numbers cannot.",
    )


def _common(column: AblationColumn, found: Sequence[Numbers]) -> list[CaseInfo]:
    """The cases of a column's splits that every row has its value for, clip by clip."""
    both = set.intersection(*(set(numbers.get(column.value, ())) for numbers in found))
    return sorted((info for info in both if info.split in column.splits), key=lambda i: (i.clip, i.id))


def _heading(column: AblationColumn) -> Heading:
    mean = f"mean of {column.value} over {' and '.join(column.splits)} pairs"
    return Heading(
        column.label, column.label, column.unit, "lower", mean if column.value else column.missing
    )


def _printed(text: str | None, footnotes: Footnotes) -> Cell:
    if text is None:
        return footnotes.missing("the paper prints no number here")
    return Cell(text, float(text), decimals=len(text.partition(".")[2]))


def _cell(
    column: AblationColumn, numbers: Numbers, cases: Sequence[CaseInfo], footnotes: Footnotes
) -> Cell:
    if not column.value:
        return footnotes.missing(column.missing)
    if not cases:
        note = footnotes.number("no case that every row answered")
        return Cell(FAILED, reason=EMPTY[FAILED], footnote=note)
    _, clips = np.unique([info.clip for info in cases], return_inverse=True)
    mine = np.array([[numbers[column.value][info] for info in cases]])
    (mean,) = means_over_clips(mine, clips)
    assert mean is not None
    text = f"{mean.value:.{DECIMALS}f}"
    return Cell(text, mean.value, mean.interval, decimals=DECIMALS, n=mean.n, clips=mean.clips)


def _counts(ablation: Ablation, common: Sequence[Sequence[CaseInfo]], label: str) -> list[str]:
    """Over what our numbers are means, in a sentence; columns with the same cases together."""
    told: dict[str, list[str]] = {}
    for column, cases in zip(ablation.columns, common, strict=True):
        if cases:
            pairs, clips = len({info.pair for info in cases}), len({info.clip for info in cases})
            what = f"{count(len(cases), 'case')}, {count(pairs, 'pair')}, {count(clips, 'clip')}"
            told.setdefault(what, []).append(column.label)
    return [f"n, {label}: {what} ({', '.join(which)})." for what, which in told.items()]
