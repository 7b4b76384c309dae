"""The numbers of the puppets' data card: sizes, splits, who is left out, and what copying loses.

    python tests/benchmarks/puppets_facts.py [--size tiny] [--every 1] [--large]

in an environment in which retarget-bench is installed. Copying is ``copy_rotations`` with the root rule
that does best, for people and for dogs, out of those that need no reference, on every so many-th case of
intra and cross. Per kind: error in the world in per cent of height, of the second answer too; contact
recall; and how far a hand ends from the place of the own body that it should rest on, in per cent of
height, where a kind has touches. The reference has error 0 and recall 1, and its hands touch to a
centimetre. ``--large`` counts the training motion of ``large`` too.
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Mapping

import numpy as np

from retarget_bench.api import SPLITS, Case, CaseInfo, Context
from retarget_bench.comparison import Comparison
from retarget_bench.datasets.puppets import held_out, parts
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.clips import SIZES, Clip, clips
from retarget_bench.datasets.puppets.families import families
from retarget_bench.datasets.puppets.places import place, touching
from retarget_bench.datasets.puppets.score import FPS, SIDES
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.metrics.contact import plugin as Contact
from retarget_bench.metrics.position import plugin as Position
from retarget_bench.motion import rotation
from retarget_bench.motion.alignment import relative
from retarget_bench.motion.motion import Motion, Positions
from retarget_bench.motion.root_rules import SCALING_RULES

Row = dict[str, float]


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


def left_out() -> None:
    found: Counter[tuple[str, str]] = Counter()
    for clip, names in Puppets(size="default").exclusions().items():
        found.update((clip.rpartition("-")[0], name) for name in names)
    by_kind = defaultdict(list)
    for (kind, name), number in sorted(found.items()):
        by_kind[kind].append(f"{name} {number}" if number > 1 else name)
    for kind, names in by_kind.items():
        print(f"{kind}: {', '.join(names)}")


def people() -> None:
    for family in families():
        held = [name for name, body in family.bodies.items() if parts.held_out(body)]
        kinds = [kind for kind in family.kinds if kind in held_out.KINDS]
        print(f"{family.name}: {len(family.bodies)} bodies, held out {', '.join(held)}")
        print(f"{family.name}: {len(family.kinds)} kinds, held out {', '.join(kinds)}")


def kinds() -> None:
    """The first sentences of what the functions say of themselves."""
    print("| kind | what is done | in the test only |\n|---|---|---|")
    for family in families():
        for kind, function in family.kinds.items():
            text = " ".join((getattr(function, "func", function).__doc__ or "").split("\n\n")[0].split())
            held = "yes" if kind in held_out.KINDS else ""
            print(f"| {kind} | {text.split(': ``')[0].rstrip('.')} | {held} |")


# ------------------------------------------------------------------------------------- copying
def touch_gap(clip: Clip, info: CaseInfo, answer: Motion | Positions, case: Case) -> float | None:
    """Mean distance of hands from their places while they should rest there, % of height; None: no touch
    whose place is on a joint of the rig."""
    score, body = clip.score(), clip.family.bodies[info.target]
    if not isinstance(answer, Motion) or clip.family.name != "people":
        return None
    turned, at, gaps = rotation.to_matrix(relative(answer)), answer.positions, []
    for side in SIDES:
        for touch in score.hands[side].touches:
            spot, full = place(touch.place, body), touch.weight == 1.0
            joint, hand = body.part[spot.part], body.part[f"{side}_hand"]
            if joint < body.structure.joints and full.any():
                end = at[:, hand] + turned[:, hand] @ touching(spot, side, body.proportions)
                gaps.append(np.linalg.norm(end - at[:, joint] - turned[:, joint] @ spot.at, axis=-1)[full])
    return float(np.concatenate(gaps).mean() * 100.0 / case.target.height) if gaps else None


def loss(data: Puppets, info: CaseInfo, listed: Mapping[str, Clip], rule: str) -> Row:
    case = data.load(info)
    answer = CopyRotations(root_rule=rule).retarget(case.source, case.target, context=Context())
    comparison = Comparison(case, answer)
    row = {"error": float(Position().compute(comparison)["mpjpe_h.world"])}
    row["recall"] = float(Contact().compute(comparison).get("contact_recall", np.nan))
    gap = touch_gap(listed[info.clip], info, answer, case)
    row["touch"] = np.nan if gap is None else gap
    assert case.alternative is not None
    row["second"] = float(Position().compute(Comparison(case, case.alternative))["mpjpe_h.world"])
    return row


def copying(size: str, every: int) -> None:
    data, listed = Puppets(size=size), {clip.name: clip for clip in clips(size, 0)}
    infos = [info for split in ("intra", "cross") for info in data.cases("retarget", split)][::every]
    rows: dict[str, list[Row]] = {"all": []}
    for family in families():
        mine = [info for info in infos if info.kind in family.kinds]
        by_rule = {rule: [loss(data, info, listed, rule) for info in mine] for rule in SCALING_RULES}
        rule = min(by_rule, key=lambda name: np.mean([row["error"] for row in by_rule[name]]))
        print(f"{family.name}: copy_rotations[root_rule={rule}] on {len(mine)} cases of {size}")
        rows |= {f"all {family.name}": by_rule[rule]}
        for info, row in zip(mine, by_rule[rule], strict=True):
            rows.setdefault(info.kind, []).append(row)
            rows["all"].append(row)
    print("\n| kind | error, % of height | second answer's | contact recall | touches missed by, % |")
    print("|---|---|---|---|---|")
    for kind, mine in rows.items():
        columns = ("error", "second", "recall", "touch")
        known = {c: [row[c] for row in mine if np.isfinite(row[c])] for c in columns}
        shown = [f"{np.mean(known[c]):.2f}" if known[c] else "" for c in columns]
        print(f"| {kind} | {' | '.join(shown)} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="tiny", choices=tuple(SIZES))
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--large", action="store_true")
    options = parser.parse_args()
    people()
    print()
    kinds()
    print()
    sizes(options.large)
    print()
    left_out()
    print()
    copying(options.size, options.every)


if __name__ == "__main__":
    main()
