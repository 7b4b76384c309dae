"""The leaderboard: tables of all submissions in a folder, with the cost of each method."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from retarget_bench.analysis import summary
from retarget_bench.errors import BenchError
from retarget_bench.exchange.submission.checking import check
from retarget_bench.exchange.submission.manifest import MANIFEST, ROWS, Cost, Manifest, read
from retarget_bench.results import store
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


def board(folder: Path, columns: Sequence[str] = builder.DEFAULT_COLUMNS) -> tuple[list[Table], list[str]]:
    """Tables of every sound submission in a folder, and sentences about those left out.

    Raises BenchError where the folder has none.
    """
    found = sorted(path.parent for path in folder.glob(f"*/{MANIFEST}"))
    if not found:
        raise BenchError(f"{folder} holds no submissions: folders with a {MANIFEST} and their rows")
    left_out, manifests, places = [], {}, []
    for each in found:
        wrong = [finding for finding in check(each) if finding.level == "error"]
        if wrong:
            left_out.append(f"{each.name} is left out: {wrong[0].text}")
            continue
        manifest = read(each)
        if manifest.method.label in manifests:
            left_out.append(f"{each.name} is left out: {manifest.method.label} is submitted twice")
            continue
        manifests[manifest.method.label] = manifest
        places += store.find_results(each / ROWS)
    if not manifests:
        raise BenchError("no submission is sound. " + ". ".join(left_out))
    wanted = tuple(column for column in columns if column != FPS) if FPS in columns else columns
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
