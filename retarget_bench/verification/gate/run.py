"""One run of the gate: measure, compare, and accept the changes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from retarget_bench import defaults
from retarget_bench.errors import BenchError
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.gate import compare, golden, method_rows, report, snapshot
from retarget_bench.verification.gate.compare import GateRow, Status
from retarget_bench.verification.gate.snapshot import GateRequest, Progress, Snapshot


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
) -> GateOutcome:
    """Measure, and compare with the golden rows in ``folder``.

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
    now = snapshot.measure(_request(folder, before, methods, dataset, accept), progress)
    if before is None:
        before = Snapshot(now.complete, now.dataset, now.smoke, {}, {})
    gone = [GateRow(Status.MOVED, label, why="forgotten") for label in forget]
    return GateOutcome([*gone, *compare.compare(before, now)], now)


def accept(folder: Path, found: GateOutcome, because: str) -> Path:
    """Make what was measured the golden rows, and log it. Returns the log's path.

    Raises BenchError, and then nothing has changed.
    """
    reason = " ".join(because.split())
    if not reason:
        raise BenchError("--accept needs a reason: --because says why the numbers may move")
    if found.verdict == 2:
        raise BenchError("nothing was accepted: something could not be measured")
    return golden.write(folder, found.now, f"{report.moved(found.lines)}. Because: {reason}")


def _request(
    folder: Path, before: Snapshot | None, methods: Sequence[str], dataset: Spec | None, accept: bool
) -> GateRequest:
    named = tuple(str(Spec.parse(each)) for each in methods)
    complete = before.complete if before is not None else not named
    labels = list(named) if named else []
    if before is not None and (accept or not named):
        labels += before.methods
    if complete and (accept or not named):
        labels += method_rows.default_methods()
    spec = dataset or Spec.parse(before.dataset["spec"] if before is not None else defaults.DATASET)
    partial = before is not None and not complete and not accept
    return GateRequest(
        methods=tuple(dict.fromkeys(labels)),
        metrics=tuple(before.metrics) if partial and before is not None else snapshot.own_metrics(),
        dataset=spec,
        wanted=_wanted(before, spec),
        folder=golden.motions(folder) if complete and (accept or not named) else None,
    )


def _wanted(before: Snapshot | None, spec: Spec) -> dict[str, list[str]] | None:
    """The cases of the golden rows, unless the data set says itself that it holds something else now."""
    from retarget_bench.evaluation.plan import dataset

    if before is None or before.dataset.get("content") != dataset(spec).content:
        return None
    return before.smoke


def nothing_moved(found: GateOutcome) -> bool:
    return all(line.status is Status.SAME for line in found.lines) and bool(found.lines)
