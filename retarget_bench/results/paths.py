"""Where the results of one method on one split lie, and the result of one case."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from retarget_bench.files import slug

CASES, ROWS, LARGE, ARRAYS, SETS = "cases.csv", "csv", "parquet", "npz", "sets.csv"
"""Ends of the names of the files that headers list."""
ARRAY_INDICES = ("joint", "frame")
"""Values with one of these indices are stored in the ``.npz``, not in rows."""

Values = dict[str, float | dict[str, float]]


@dataclass(frozen=True)
class ResultPaths:
    """Paths of the results of one method on one split of a data set.

    Results that a run has begun, and not completed, replace older ones.
    """

    root: Path
    dataset: str
    task: str
    split: str
    method: str

    @property
    def folder(self) -> Path:
        return self.root / self.dataset / self.task / self.split

    @property
    def kind(self) -> str:
        """The name of the task, without its parameters: see ``Spec.slug``."""
        return re.sub(r"-[0-9a-f]{8}$", "", self.task)

    @property
    def rows(self) -> Path:
        return self.file(ROWS)

    @property
    def large(self) -> Path:
        """Rows and arrays of results of many cases, which have neither of the two others."""
        return self.file(LARGE)

    @property
    def arrays(self) -> Path:
        return self.file(ARRAYS)

    @property
    def header(self) -> Path:
        return self.folder / f"{self.method}.json"

    @property
    def timing(self) -> Path:
        return self.folder / f"{self.method}.timing.csv"

    @property
    def log(self) -> Path:
        return self.folder / f"{self.method}.log"

    @property
    def journal(self) -> Path:
        return self.folder / f"{self.method}.journal"

    @property
    def begun(self) -> Path:
        return self.folder / f"{self.method}.begun"

    @property
    def any_header(self) -> Path:
        """The header; of results that are not complete the one that their run began with."""
        return self.header if self.complete else self.begun

    @property
    def complete(self) -> bool:
        """Whether all cases are there; False of results that a run has begun and not completed."""
        return not self.begun.exists()

    @property
    def cases(self) -> Path:
        return self.folder / CASES

    @property
    def sets(self) -> Path:
        """The values of whole sets, where a metric has any."""
        return self.file(SETS)

    def file(self, end: str) -> Path:
        """The file that a header lists by this end of its name."""
        return self.cases if end == CASES else self.folder / f"{self.method}.{end}"

    def prediction(self, case_id: str) -> Path:
        return self.folder / self.method / f"{case_file(case_id)}.npz"


@dataclass
class CaseResult:
    """The result of one case.

    faults: metric -> a sentence on what it did wrong with this case, which therefore lacks its values.
    """

    case: str
    status: str
    message: str = ""
    values: Values = field(default_factory=dict)
    faults: dict[str, str] = field(default_factory=dict)


def case_file(case_id: str) -> str:
    """The file name, without suffix, of a case's prediction."""
    return slug(case_id.replace("/", "--").replace(">", "-to-"))
