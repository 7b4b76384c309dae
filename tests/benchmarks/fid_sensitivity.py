"""What the shipped feature networks notice: FID, KID, coverage and density of real motion made worse.

Either half of the performances against real motion of the other half, averaged, per structure. As many
windows as FID asks for need some 160 performances.
Run: ``python tests/benchmarks/fid_sensitivity.py [--performances N] [--structure NAME]``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).parents[1] / "metrics"))
from corruptions import HARMS, Study, mirror, reverse

from retarget_bench.metrics.fid import SHIPPED
from retarget_bench.plugins import registry

ALL = {**HARMS, "time reversed": (reverse, (1.0,)), "mirrored": (mirror, (1.0,))}


def main() -> None:
    """Print a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--performances", type=int, default=160)
    parser.add_argument("--structure", action="append", help="may be repeated; all by default")
    given = parser.parse_args()
    puppets = registry.create("datasets", "puppets[size=default]")
    print("| structure | harm | amount | n | FID | KID | coverage | density |")
    print("|---|---|---|---|---|---|---|---|")
    for structure in given.structure or sorted(path.stem for path in SHIPPED.glob("*.json")):
        study = Study(puppets, structure, given.performances)
        rows = [("none: the floor", None, 0.0)]
        rows += [(name, harm, amount) for name, (harm, amounts) in ALL.items() for amount in amounts]
        for name, harm, amount in tqdm(rows, desc=structure, leave=False, disable=None):
            seen = study.notice(harm, amount)
            print(
                f"| {structure} | {name} | {amount:g} | {seen.n} | {seen.fid:.1f} | "
                f"{seen.kid:.3f} | {seen.coverage:.3f} | {seen.density:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
