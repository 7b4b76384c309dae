"""Numbers of the puppets: sizes and splits of their data card, and what copying loses.

    python benchmarks/puppets_facts.py [--size tiny] [--every 1] [--large]

in an environment in which retarget-bench is installed. Copying is ``copy_rotations`` with the root rule
that has the least error in the world, for people and for dogs, out of those that need no reference, on
every so many-th case of intra and cross. Per kind, from the metrics of those names: error in the world, of
the second answer too; contact recall by speed; contact recall and drift by position; self-contact error
and recall where a kind has touches. The reference has errors 0 and recalls 1. ``--large`` counts the
training of ``large`` too.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence

import numpy as np

from retarget_bench.api import SPLITS, Case, CaseInfo, Context
from retarget_bench.api.comparison import Comparison
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.generator.conventions import FPS
from retarget_bench.datasets.puppets.generator.corpus.clips import SIZES, clips
from retarget_bench.datasets.puppets.generator.corpus.families import families
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.metrics.contact import plugin as Contact
from retarget_bench.metrics.contact_speed import plugin as ContactSpeed
from retarget_bench.metrics.position import plugin as Position
from retarget_bench.metrics.touch import plugin as SelfTouch
from retarget_bench.motion.root_rules import SCALING_RULES

Row = dict[str, float]
SHOWN = {
    "mpjpe_h.world": "error, % of height",
    "second": "second answer's",
    "contact_recall.speed": "contact recall, by speed",
    "contact_recall": "contact recall, by position",
    "contact_drift": "contact drift, %",
    "touch_gap": "self-contact error, %",
    "touch_recall": "touch recall",
}
""""second": the error in the world of the other right answer."""


def sizes(large: bool) -> None:
    print("| size | part | clips | of 60 s | minutes | cases self / intra / cross | left out | training |")
    print("|---|---|---|---|---|---|---|---|")
    for size, part in [(size, part) for size in SIZES for part in ("test", "validation")]:
        data, listed = Puppets(size=size, part=part), clips(size, 0, part)
        cases = " / ".join(str(len(data.cases("retarget", split))) for split in SPLITS)
        hours = ""
        if part == "test" and (large or size != "large"):
            frames = sum(each.frames for cast in data.training().values() for each in cast.values())
            hours = f"{frames / FPS / 3600:.1f} h"
        out = sum(map(len, data.exclusions().values()))
        minutes = sum(clip.frames for clip in listed) / FPS / 60
        long = sum(clip.long for clip in listed)
        print(f"| {size} | {part} | {len(listed)} | {long} | {minutes:.1f} | {cases} | {out} | {hours} |")


# ------------------------------------------------------------------------------------- copying
def copied(case: Case, rule: str) -> Comparison:
    answer = CopyRotations(root_rule=rule).retarget(case.source, case.target, context=Context())
    return Comparison(case, answer)


def world(comparison: Comparison) -> float:
    """Error in the world, % of height."""
    value = Position().compute(comparison)["mpjpe_h.world"]
    assert not isinstance(value, Mapping)
    return value


def loss(case: Case, rule: str) -> Row:
    """The loss of copying by a root rule in a case: ids of ``SHOWN``, those that apply."""
    assert case.alternative is not None
    comparison = copied(case, rule)
    row = {"mpjpe_h.world": world(comparison), "second": world(Comparison(case, case.alternative))}
    for metric in (ContactSpeed(), Contact(), SelfTouch()):
        values = metric.compute(comparison)
        row |= {id_: float(values[id_]) for id_ in SHOWN if id_ in values}
    return row


def best(data: Puppets, infos: Sequence[CaseInfo]) -> tuple[str, list[Row]]:
    """The root rule with the least error in the world, and what it loses in every case."""
    errors = dict.fromkeys(SCALING_RULES, 0.0)
    for info in infos:
        case = data.load(info)
        for rule in SCALING_RULES:
            errors[rule] += world(copied(case, rule))
    rule = min(errors, key=errors.__getitem__)
    return rule, [loss(data.load(info), rule) for info in infos]


def mean(rows: Sequence[Row], id_: str) -> float:
    """The mean over the cases that have the value; NaN where none has."""
    values = [row[id_] for row in rows if id_ in row]
    return float(np.mean(values)) if values else float("nan")


def copying(size: str, every: int) -> None:
    data = Puppets(size=size)
    infos = [info for split in ("intra", "cross") for info in data.cases("retarget", split)][::every]
    rows: dict[str, list[Row]] = {"all": []}
    for family in families():
        chosen = [info for info in infos if info.kind in family.kinds]
        rule, copied = best(data, chosen)
        print(f"{family.name}: copy_rotations[root_rule={rule}] on {len(chosen)} cases of {size}")
        rows["all"] += copied
        rows[f"all {family.name}"] = copied
        for split in dict.fromkeys(info.split for info in chosen):
            rows[f"{family.name}, {split}"] = []
        for info, row in zip(chosen, copied, strict=True):
            rows[f"{family.name}, {info.split}"].append(row)
            rows.setdefault(info.kind, []).append(row)
    print(f"\n| kind | {' | '.join(SHOWN.values())} |")
    print("|---" * (len(SHOWN) + 1) + "|")
    for kind, chosen in rows.items():
        means = [mean(chosen, id_) for id_ in SHOWN]
        shown = [f"{value:.2f}" if np.isfinite(value) else "" for value in means]
        print(f"| {kind} | {' | '.join(shown)} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="tiny", choices=tuple(SIZES))
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--large", action="store_true")
    options = parser.parse_args()
    sizes(options.large)
    print()
    copying(options.size, options.every)


if __name__ == "__main__":
    main()
