"""Cases of the task ``points`` between held-out puppets, answered and scored on one core, and their means.

For ``correspondence_free.py`` and ``correspondence_free_ablations.py``: what was scored stays in a file for
each method, so that an interrupted run goes on, and counts while code, weights and data are the same.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.analysis.summary import Mean, means_over_clips
from retarget_bench.api import Case, CaseInfo
from retarget_bench.evaluation.predict import as_scored, context_for, predict
from retarget_bench.evaluation.score import score
from retarget_bench.files import digest, write_text
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import case_seed

TASK = "points"
SPLITS = ("intra", "cross")
METRICS = ("position", "procrustes", "smoothness", "vertex_error")
COLUMNS = {
    "mpjpe_h.world": "MPJPE",
    "pa_mpjpe.rigid": "PA-MPJPE",
    "acc": "Acc",
    "pa_acc.rigid": "PA-Acc",
    "mpvd_h": "MPVD",
    "pa_mpvd.rigid": "PA-MPVD",
    "medl_h": "MEDL",
}
"""Value -> its heading in the paper; metres, and metres per squared frame of 30 per second."""
ACCELERATIONS = ("acc", "pa_acc.rigid")
"""Those that are in metres as they are; the others are in per cent of the height."""

Numbers = Mapping[str, Mapping[str, float]]
"""Case id -> value id -> number."""


def held_out(data: Any, clips: int) -> list[CaseInfo]:
    """Cases between two-legged bodies that no training has seen: so many clips of each split, one case of
    each clip.

    Clips are spread evenly over the list, and the pairs of bodies over the clips.
    """
    manifest, characters = data.training_manifest(), data.characters()
    trained = {*manifest["characters"], *manifest.get("validation", ())}
    fit = {name for name, each in characters.items() if name not in trained and not each.four_legged}
    infos = []
    for split in SPLITS:
        by_clip: dict[str, list[CaseInfo]] = {}
        for info in data.cases(TASK, split):
            if info.source in fit and info.target in fit:
                by_clip.setdefault(info.clip, []).append(info)
        names = list(by_clip)
        chosen = np.unique(np.linspace(0, len(names) - 1, min(clips, len(names))).round().astype(int))
        infos += [by_clip[names[k]][k % len(by_clip[names[k]])] for k in chosen]
    return infos


def scored(spec: Spec, data: Any, infos: Sequence[CaseInfo], file: Path) -> Numbers:
    """The paper's values of a method's answers; what the file has of this very method is not asked again.

    Raises SystemExit where the method gives no answer.
    """
    method = bound.method(spec).built
    built = [bound.method(spec).code, method.weights_hash, data.content]
    key = digest(repr([*built, str(bound.method(spec).known_as), bound.metrics(METRICS).versions]))
    metrics = bound.metrics(METRICS).of_cases

    def values(case: Case) -> dict[str, float]:
        seed = case_seed(0, str(bound.method(spec).known_as), case.info.id)
        outcome = predict(method, case, context_for(method, data, case, seed))
        if outcome.prediction is None:
            raise SystemExit(f"{spec}, {case.info.id}: {outcome.message}")
        scores: dict[str, Any] = score(metrics, case, as_scored(outcome.prediction)).sound()
        metres = case.target.height / 100.0
        return {name: scores[name] * (1.0 if name in ACCELERATIONS else metres) for name in COLUMNS}

    return remembered(str(spec), values, data, infos, file, key)


def remembered(
    label: str,
    values: Callable[[Case], Mapping[str, float]],
    data: Any,
    infos: Sequence[CaseInfo],
    file: Path,
    key: str,
) -> Numbers:
    """The values of every case, from lines of the file that have this key or computed and added there."""
    file.parent.mkdir(parents=True, exist_ok=True)
    stored = {}
    for line in file.read_text().splitlines() if file.exists() else []:
        try:
            entry = json.loads(line)
        except ValueError:  # the run ended while it wrote this line
            continue
        if entry["key"] == key:
            stored[entry["case"]] = entry["values"]
    for number, info in enumerate(infos, 1):
        if info.id not in stored:
            stored[info.id] = dict(values(data.load(info)))
            with file.open("a") as there:
                there.write("\n" + json.dumps({"key": key, "case": info.id, "values": stored[info.id]}))
            print(f"{label}: {number} of {len(infos)} cases", flush=True)
    return {info.id: stored[info.id] for info in infos}


def means(numbers: Numbers, infos: Sequence[CaseInfo], value: str) -> Mean:
    """The mean over clips of means over a clip's cases."""
    return mean([numbers[info.id][value] for info in infos], infos)


def mean(values: Sequence[float], infos: Sequence[CaseInfo]) -> Mean:
    """The mean over clips of one number for each case, with its interval."""
    _, clips = np.unique([info.clip for info in infos], return_inverse=True)
    (result,) = means_over_clips(np.array([values], dtype=float), clips)
    assert result is not None
    return result


def shown(average: Mean, digits: int = 4) -> str:
    """``0.0512 [0.0490, 0.0533]``."""
    interval = average.interval
    ends = f" [{interval.low:.{digits}f}, {interval.high:.{digits}f}]" if interval else ""
    return f"{average.value:.{digits}f}{ends}"


def row(label: str, cells: Sequence[str]) -> str:
    return f"| {label} | {' | '.join(cells)} |"


def heading(first: str) -> list[str]:
    """The two lines above a table of ``COLUMNS``."""
    return [row(first, list(COLUMNS.values())), "|---|" + "---:|" * len(COLUMNS)]


def size(infos: Sequence[CaseInfo]) -> str:
    """``120 cases of 78 clips between 16 bodies``."""
    bodies = {name for info in infos for name in (info.source, info.target)}
    return f"{len(infos)} cases of {len({info.clip for info in infos})} clips between {len(bodies)} bodies"


def write_part(file: Path, title: str, lines: Sequence[str]) -> None:
    """Write the part of a page under a heading of the second level anew; what others wrote stays."""
    text = file.read_text(encoding="utf-8") if file.exists() else "# Correspondence-free retargeting\n"
    head, *parts = text.split("\n## ")
    sections = {part.partition("\n")[0]: part.partition("\n")[2] for part in parts}
    sections[title] = "\n" + "\n".join(lines).strip() + "\n"
    write_text(
        file, head.rstrip() + "\n" + "".join(f"\n## {name}\n{body}" for name, body in sections.items())
    )
