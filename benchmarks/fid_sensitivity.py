"""Sensitivity of the shipped feature networks: FID, KID, coverage and density of degraded motion.

Either half of the performances against real motion of the other half, averaged, per structure. As many
windows as FID asks for need some 160 performances. With ``--people``: FID of people, of the references of
the main job's splits or, with ``--takes FOLDER``, of the motion of a folder of BVH files.
Run: ``python benchmarks/fid_sensitivity.py [--performances N] [--structure NAME]``, or with
``--people [--takes FOLDER]``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "metrics"))
from corruptions import HARMS, MORE_HARMS, Crowd, Study, mirror, people_in, reverse, seen

from retarget_bench.metrics.fid_structure import SHIPPED
from retarget_bench.plugins import registry

ALL = {**HARMS, "time reversed": (reverse, (1.0,)), "mirrored": (mirror, (1.0,))}


def main() -> None:
    """Print a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--performances", type=int, default=160)
    parser.add_argument("--structure", action="append", help="may be repeated; all by default")
    parser.add_argument("--people", action="store_true", help="FID of people instead")
    parser.add_argument("--takes", type=Path, help="with --people: a folder of BVH files")
    options = parser.parse_args()
    if options.people:
        people(options.takes)
        return
    puppets = registry.create("datasets", "puppets[size=default]")
    print("| structure | harm | amount | n | FID | KID | coverage | density |")
    print("|---|---|---|---|---|---|---|---|")
    for structure in options.structure or sorted(path.stem for path in SHIPPED.glob("*.json")):
        study = Study(puppets, structure, options.performances)
        rows = [("none: the floor", None, 0.0)]
        rows += [(name, harm, amount) for name, (harm, amounts) in ALL.items() for amount in amounts]
        for name, harm, amount in tqdm(rows, desc=structure, leave=False, disable=None):
            effect = study.notice(harm, amount)
            print(
                f"| {structure} | {name} | {amount:g} | {effect.n} | {effect.fid:.1f} | "
                f"{effect.kid:.3f} | {effect.coverage:.3f} | {effect.density:.2f} |",
                flush=True,
            )


def people(takes: Path | None) -> None:
    """Print a table of FID of people in Markdown."""
    print("| motion | harm | amount | n | FID |")
    print("|---|---|---|---|---|")
    for title, crowd in [(takes.name, people_in(takes))] if takes else _of_the_main_job():
        rows = [("none: the floor", None, 0.0)]
        more = {**ALL, **MORE_HARMS}
        rows += [(name, harm, amount) for name, (harm, amounts) in more.items() for amount in amounts]
        for name, harm, amount in rows:
            number = crowd.notice(harm, amount)
            print(f"| {title} | {name} | {amount:g} | {crowd.sets().n} | {number:.2f} |", flush=True)
        crowd.stretches = None
        print(f"| {title} | none, halves of whole clips | 0 | {crowd.sets().n} | {crowd.notice():.2f} |")


def _of_the_main_job() -> Iterator[tuple[str, Crowd]]:
    puppets = registry.create("datasets", "puppets[size=tiny]")
    cast = puppets.characters()
    for split in ("intra", "cross"):
        infos = puppets.cases("retarget", split)
        by_clip = {info.clip: info for info in infos if not cast[info.target].four_legged}
        yield split, Crowd({clip: seen(puppets.load(info).reference) for clip, info in by_clip.items()})


if __name__ == "__main__":
    main()
