"""Joints that ``ik`` turns faster than the source, beside what it costs elsewhere, with copying for scale.

    python tests/benchmarks/ik_snaps.py [--mixamo DIR] [--files DIR] [--every N] [--worst N]

On ``puppets[size=tiny]``, on a folder of Mixamo motions (cross), and between the BVH files of the folders
below ``--files``: every file is a source for the bodies of the other folders' first files. Columns:
position error with and without root (% of height), contact recall by place and height, joint speed excess,
jerk ratio, foot skating (% of height per second), depth below the floor and float above it (cm),
self-contact error; the 95th percentile of the joint speed excess and the share of cases above 1.5. Pairs of
files have no reference: contacts, skating and jerk are measured against the source.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from retarget_bench.api import Case, CaseInfo, Context
from retarget_bench.api.comparison import Comparison
from retarget_bench.datasets.mixamo import plugin as Mixamo
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.methods.ik import plugin as InverseKinematics
from retarget_bench.metrics import contact as contact_metric
from retarget_bench.metrics import ground, joint_speed, position, slide, smoothness, touch
from retarget_bench.motion import importer

METRICS = [
    each.plugin() for each in (position, contact_metric, joint_speed, smoothness, slide, ground, touch)
]
COLUMNS = {
    "MPJPE": "mpjpe_h.world",
    "aligned": "mpjpe_h.root",
    "contact": "contact_recall",
    "excess": "joint_speed_excess",
    "jerk": "jerk_ratio",
    "skating": "foot_slide_h",
    "depth": "penetration.mean",
    "floats": "floating.mean",
    "touch": "touch_gap",
}
LENGTH = 600
"""Frames of a file that are used."""


def of(data: Puppets | Mixamo, splits: tuple[str, ...], every: int) -> Iterator[Case]:
    """Every so many-th case of a data set."""
    for split in splits:
        for info in data.cases("retarget", split)[::every]:
            yield data.load(info)


def between(files: Path, every: int) -> Iterator[Case]:
    """Every so many-th pair of a file and a body of another folder."""
    folders: dict[str, list[Path]] = {}
    for file in sorted(files.rglob("*.bvh")):
        folders.setdefault(str(file.parent.relative_to(files)), []).append(file)
    motions = {file: importer.load(file).motion for each in folders.values() for file in each}
    pairs = [
        (file, other[0])
        for folder, each in folders.items()
        for file in each
        for name, other in folders.items()
        if name != folder
    ]
    for file, target in pairs[::every]:
        source = motions[file].at(slice(0, LENGTH))
        where = f"{file.parent.name}/{file.stem}"
        info = CaseInfo(f"{where}>{target.parent.name}", "retarget", "cross", where, target.stem, where)
        yield Case(info, source, motions[target].character)


def values(case: Case, method: CopyRotations | InverseKinematics) -> dict[str, float]:
    """What the columns show of one case; empty where the method refuses it."""
    if method.supports(case.source.character, case.target):
        return {}
    comparison = Comparison(case, method.retarget(case.source, case.target, context=Context()))
    found = {k: v for metric in METRICS for k, v in metric.compute(comparison).items()}
    return {
        name: value
        for name, id_ in COLUMNS.items()
        if (value := found.get(id_, found.get(f"{id_}_src"))) is not None
    }


def table(title: str, cases: list[Case], worst: int) -> None:
    """Print the means of both methods over these cases, and the cases in which joints are fastest."""
    print(f"\n{title}: {len(cases)} cases")
    print(f"{'':<16}" + "".join(f"{n:>9}" for n in COLUMNS) + f"{'p95':>9}{'> 1.5':>9}")
    for method in (CopyRotations(), InverseKinematics()):
        rows = [values(case, method) for case in cases]
        means = [np.mean([r[n] for r in rows if n in r] or [np.nan]) for n in COLUMNS]
        excess = np.array([row.get("excess", 1.0) for row in rows])
        means += [np.quantile(excess, 0.95), 100 * (excess > 1.5).mean()]
        print(f"{method.card.name:<16}" + "".join(f"{mean:>9.3f}" for mean in means) + " %")
    for k in np.argsort(-excess)[:worst]:
        print(f"    {excess[k]:6.2f}  {cases[k].info.id}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--mixamo", type=Path)
    parser.add_argument("--files", type=Path)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--worst", type=int, default=0)
    options = parser.parse_args()
    puppets = Puppets(size="tiny")
    table("puppets", list(of(puppets, ("self", "intra", "cross"), options.every)), options.worst)
    if options.mixamo:
        mixamo = Mixamo(root=str(options.mixamo))
        table("Mixamo, cross", list(of(mixamo, ("cross",), options.every)), options.worst)
    if options.files:
        table("files", list(between(options.files, options.every)), options.worst)


if __name__ == "__main__":
    main()
