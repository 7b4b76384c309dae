"""The leaderboard: tables of all submissions in a folder, with the cost of each method."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from retarget_bench.analysis import summary
from retarget_bench.errors import BenchError, FileError, printable
from retarget_bench.exchange.submission.checking import LONGEST, check
from retarget_bench.exchange.submission.folder import faults
from retarget_bench.exchange.submission.manifest import MANIFEST, ROWS, Cost, Manifest, read
from retarget_bench.results import store
from retarget_bench.results.store import CaseResult, ResultPaths
from retarget_bench.tables import builder
from retarget_bench.tables.groups import FPS
from retarget_bench.tables.model import Cell, Column, Group, Table

COSTS = (
    Column("cost.parameters", "parameters", "1", "none", "numbers that were learnt"),
    Column("cost.training_hours", "training", "hours", "none", "training of all runs behind the weights"),
    Column("cost.peak_memory_mb", "memory", "MB", "none", "what a process grows by while it retargets"),
    Column(
        "cost.lookahead_frames",
        "look-ahead",
        "frames",
        "none",
        "frames after the present one that the method needs; clip: the whole clip, so it cannot run live",
    ),
    Column("cost.fps", "speed", "frames/s", "none", "frames per second of one process and one thread"),
)
"""As submitted; measured on the submitters' machines, so not ranked."""
LAST = "9999"


def board(folder: Path, columns: Sequence[str] = builder.DEFAULT_COLUMNS) -> tuple[list[Table], list[str]]:
    """Tables of every sound submission in a folder, and sentences about those left out.

    Of two that are equal, or of one method, the older one is shown, by the dates of their rows. Raises
    BenchError where the folder has none.
    """
    found = sorted((path.parent for path in folder.glob(f"*/{MANIFEST}")), key=_age)
    if not found:
        raise BenchError(f"{folder} holds no submissions: folders with a {MANIFEST} and their rows")
    wanted = tuple(column for column in columns if column != FPS) if FPS in columns else columns
    left_out: list[str] = []
    manifests: dict[str, Manifest] = {}
    places: list[ResultPaths] = []
    for each in found:
        try:
            manifest, mine = _sound(each, wanted)
            if manifest.method.label in manifests:
                raise BenchError(f"{manifest.method.label} is submitted twice")
            if same := [other for other in places if _twin(other, mine)]:
                raise BenchError(f"its rows are those of {same[0].root.parent.name}")
        except Exception as error:  # whatever somebody sent, the others are shown
            left_out.append(
                printable(f"{each.name} is left out: {str(error) or type(error).__name__}")[:LONGEST]
            )
            continue
        manifests[manifest.method.label] = manifest
        places += mine
    left_out.sort()
    if not manifests:
        raise BenchError("no submission is sound. " + ". ".join(left_out))
    made = builder.tables(summary.split_summaries(places), wanted)
    about = [_credit(manifest) for _, manifest in sorted(manifests.items())]
    shown = [
        replace(
            each,
            groups=tuple(_group(group, manifests) for group in each.groups),
            notes=(*each.notes, *about, *left_out),
        )
        for each in made
    ]
    return shown, left_out


def _sound(folder: Path, columns: Sequence[str]) -> tuple[Manifest, list[ResultPaths]]:
    """A submission that can be shown: its table is made alone first. Raises BenchError for another."""
    if folder.is_symlink():
        raise BenchError("it is a link; a submission is a folder of its own")
    if wrong := [finding for finding in check(folder) if finding.level == "error"]:
        raise BenchError(wrong[0].text)
    places = store.find_results(folder / ROWS)
    builder.tables(summary.split_summaries(places), columns)
    return read(folder), places


def _age(folder: Path) -> tuple[str, str]:
    """Sorts submissions by when the last of their rows were made; those that do not say come last."""
    dates = []
    for place in store.find_results(folder / ROWS) if not faults(folder) else ():
        with suppress(FileError):
            dates.append(str(store.read_header_facts(place.any_header).get("date") or LAST))
    return max(dates, default=LAST), folder.name


def _twin(other: ResultPaths, mine: Sequence[ResultPaths]) -> bool:
    """True where one of the results has the very values of another submission's, however written."""
    return any(
        (one.dataset, one.split) == (other.dataset, other.split) and _values(one) == _values(other)
        for one in mine
    )


def _values(place: ResultPaths) -> list[CaseResult]:
    return store.read_results(place).entries


def _group(group: Group, manifests: Mapping[str, Manifest]) -> Group:
    ranked, unranked = (
        tuple(replace(row, cells=(*row.cells, *_cells(manifests[row.label].cost))) for row in rows)
        for rows in (group.ranked, group.unranked)
    )
    return replace(
        group,
        columns=(*group.columns, *COSTS),
        ranked=ranked,
        unranked=unranked,
        common=(*group.common, *(None for _ in COSTS)),
    )


def _cells(cost: Cost) -> list[Cell]:
    ahead = cost.lookahead_frames
    return [
        Cell(f"{cost.parameters:,}", float(cost.parameters)),
        Cell(f"{cost.training_hours:g}", cost.training_hours),
        Cell(f"{cost.peak_memory_mb:.4g}", cost.peak_memory_mb),
        Cell("clip", float("inf")) if ahead == "clip" else Cell(str(ahead), float(ahead)),
        Cell(f"{cost.frames_per_second:,.0f}", cost.frames_per_second),
    ]


def _credit(manifest: Manifest) -> str:
    about = manifest.method
    links = [link for link in (about.paper, about.code, about.contact) if link]
    trained = ", ".join(manifest.data.trained_on) or "nothing"
    hardware = f" on {manifest.cost.hardware}" if manifest.cost.hardware else ""
    return (
        f"{about.label} {about.version}: {about.summary}. By {', '.join(about.authors)}; {about.licence}"
        + (f"; {', '.join(links)}" if links else "")
        + f". Trained on {trained}{hardware}."
    )
