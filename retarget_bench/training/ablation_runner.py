"""``bench ablate``: trains the rows of an ablation under one budget, runs them, and makes the table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import columns, compatibility, store
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
NOT_PRINTED = "the paper prints no number here"

Numbers = Mapping[str, Mapping[CaseInfo, float]]
"""Value id -> case -> number."""


@dataclass(frozen=True)
class TrainedRow:
    """A row of an ablation with its weights. folder: of the training run."""

    row: AblationRow
    method: Spec
    folder: Path

    @property
    def ready(self) -> Spec:
        """The method with the row's weights."""
        return registry.canonical("methods", self.method.with_parameters(weights=str(self.folder)))


@dataclass(frozen=True)
class AblationFacts:
    """What a table says of how its rows came about.

    trained, tested: labels of data sets, the same where nothing else was asked. recipe: of every row.
    """

    trained: str
    tested: str
    recipe: str

    @property
    def data(self) -> str:
        """The end of "the row was ..."."""
        if self.trained == self.tested:
            return f"trained and run here, on {self.tested}"
        return f"trained here on {self.trained} and run on {self.tested}"


def find(method: Spec, name: str) -> Ablation:
    """A method's ablation by name.

    Raises BenchError, with those that there are, or where the method already says what rows change.
    """
    if method.posts:
        raise BenchError(f"{method}: post-processors have no part in an ablation; ablate {method.alone}")
    offered: Mapping[str, Ablation] = getattr(plan.method(method), "ablations", {})
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
    """What would stand in the way once all is trained.

    Raises BenchError where no metric has a column's value, or the data set to test on no case for a column.
    """
    _metrics(ablation)
    tested = plan.dataset(data)
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
        made.append(TrainedRow(row, spec, out / "train" / spec.slug))
    return made


def plan_of(
    ablation: Ablation, trained: Sequence[TrainedRow], data: Spec, out: Path, jobs: int
) -> plan.Plan:
    """What has to be predicted and scored on the data set to test on. Raises BenchError; see ``check``."""
    return plan.Plan(
        methods=tuple(dict.fromkeys(each.ready for each in trained)),
        datasets=(data,),
        splits=tuple(dict.fromkeys(split for column in ablation.columns for split in column.splits)),
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


def numbers_of(asked: plan.Plan, trained: Sequence[TrainedRow]) -> list[Numbers]:
    """What every row scored, from the results of a plan that was carried out."""
    places: dict[Spec, list[ResultPaths]] = {}
    for cell in plan.evaluation_units(asked):
        places.setdefault(cell.known_as, []).append(cell.paths)
    return [_numbers(places[plan.known_as(each.ready)]) for each in trained]


def _numbers(places: Sequence[ResultPaths]) -> Numbers:
    headers = [store.read_header(place.header) for place in places]
    newest = compatibility.newest(headers)
    found: dict[str, dict[CaseInfo, float]] = {}
    for place, header in zip(places, headers, strict=True):
        part = columns.read(place, header, newest)
        for (value, index), column in part.numbers.items():
            if not index:
                there = zip(part.cases, column.tolist(), strict=True)
                found.setdefault(value, {}).update({c: x for c, x in there if not np.isnan(x)})
    return found


# ------------------------------------------------------------------------------------------ the table
def table(
    ablation: Ablation, trained: Sequence[TrainedRow], found: Sequence[Numbers], told: AblationFacts
) -> Table:
    """Every row twice where it is printed: so, and as it came out here.

    Ours are means over clips of means per clip, over the cases that all rows have a number for.
    """
    footnotes = Footnotes()
    common = {column.label: _common(column, found) for column in ablation.columns}
    lines = []
    for each, numbers in zip(trained, found, strict=True):
        if each.row.printed:
            lines.append(_printed(ablation, each.row, footnotes))
        cells = tuple(
            _cell(column, numbers, common[column.label], footnotes) for column in ablation.columns
        )
        lines.append(Line(each.row.label, "", cells, _n(cells), str(each.method)))
    group = Group(
        title=ablation.paper,
        split="",
        columns=tuple(_heading(column) for column in ablation.columns),
        ranked=tuple(lines),
        unranked=(),
        heading="row",
    )
    return Table(
        title=ablation.title,
        groups=(group,),
        notes=(
            f"Every row: {told.recipe}, trained on {told.trained}, tested on {told.tested}.",
            *_counts(ablation, common, told.tested),
            *ablation.notes,
        ),
        footnotes=tuple(footnotes.sentences),
        reading=f"Rows marked '{PRINTED}' are the paper's numbers, on the paper's data; the row under each "
        f"was {told.data}: how rows differ can be compared, the numbers cannot.",
    )


def _n(cells: Sequence[Cell]) -> str:
    """Of the cells' cases; columns may be over different splits."""
    return ", ".join(dict.fromkeys(str(cell.n) for cell in cells if cell.value is not None)) or "0"


def _common(column: AblationColumn, found: Sequence[Numbers]) -> list[CaseInfo]:
    """The cases of a column's splits that every row has its value for."""
    each = [set(numbers.get(column.value, ())) for numbers in found]
    both = set.intersection(*each) if each else set()
    return sorted((info for info in both if info.split in column.splits), key=lambda info: info.id)


def _heading(column: AblationColumn) -> Heading:
    meaning = (
        f"mean of {column.value} over {' and '.join(column.splits)} pairs"
        if column.value
        else column.missing
    )
    return Heading(column.label, column.label, column.unit, "lower", meaning)


def _printed(ablation: Ablation, row: AblationRow, footnotes: Footnotes) -> Line:
    cells = []
    for column in ablation.columns:
        text = row.printed.get(column.label)
        if text is None:
            cells.append(footnotes.missing(NOT_PRINTED))
        else:
            cells.append(Cell(text, float(text), decimals=_decimals(text)))
    return Line(f"{row.label} ({PRINTED})", "", tuple(cells), "")


def _cell(
    column: AblationColumn, numbers: Numbers, common: Sequence[CaseInfo], footnotes: Footnotes
) -> Cell:
    if not column.value:
        return footnotes.missing(column.missing)
    if not common:
        return Cell(
            FAILED, reason=EMPTY[FAILED], footnote=footnotes.number("no case that every row answered")
        )
    by_clip: dict[str, list[float]] = {}
    for info in common:
        by_clip.setdefault(info.clip, []).append(numbers[column.value][info])
    means = np.array([[np.mean(mine) for mine in by_clip.values()]])
    value = float(means.mean())
    return Cell(
        f"{value:.{DECIMALS}f}",
        value,
        interval=statistics.mean_intervals(means)[0],
        decimals=DECIMALS,
        n=len(common),
        clips=len(by_clip),
    )


def _counts(ablation: Ablation, common: Mapping[str, Sequence[CaseInfo]], label: str) -> list[str]:
    """Over what our numbers are means, in a sentence; columns with the same cases together."""
    told: dict[str, list[str]] = {}
    for column in ablation.columns:
        if cases := common[column.label]:
            pairs, clips = len({info.pair for info in cases}), len({info.clip for info in cases})
            what = f"{count(len(cases), 'case')}, {count(pairs, 'pair')}, {count(clips, 'clip')}"
            told.setdefault(what, []).append(column.label)
    return [f"n, {label}: {what} ({', '.join(which)})." for what, which in told.items()]


def _decimals(text: str) -> int:
    return len(text.partition(".")[2])
