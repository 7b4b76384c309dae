"""What the post-processor footfix does to foot contacts: means of methods alone and with it, on puppets.

    python tests/benchmarks/footfix_effect.py [METHOD...]

Prints, for every method and split, recall and precision of contacts, slide and position error without and
with footfix. Results are kept in runs/footfix_effect and not computed again.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tqdm import tqdm

from retarget_bench.analysis import summary
from retarget_bench.evaluation import runner
from retarget_bench.evaluation.plan import Plan
from retarget_bench.plugins.spec import Spec

VALUES = (
    "contact_recall.speed",
    "contact_precision.speed",
    "foot_slide_h",
    "mpjpe_h.world",
    "acceleration",
)


def main(methods: list[str]) -> None:
    texts = [text for name in methods for text in (name, f"{name}+footfix")]
    plan = Plan(
        methods=tuple(map(Spec.parse, texts)),
        datasets=(Spec.parse("puppets[size=tiny]"),),
        splits=("intra", "cross"),
        metrics=("contact_speed", "slide", "position", "smoothness"),
        root=Path("runs/footfix_effect"),
    )
    with tqdm(unit="case", leave=False) as bar:

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        places = runner.run(plan, progress)
    print("split   method                        " + "".join(f"{value:>18}" for value in VALUES))
    for section in summary.split_summaries(places):
        for score in section.scores:
            means = [score.means.get(value) for value in VALUES]
            shown = "".join(f"{mean.value:18.3f}" if mean else f"{'':>18}" for mean in means)
            print(f"{section.split:<8}{score.label:<30}{shown}  ({score.ok} of {score.asked} cases)")


if __name__ == "__main__":
    main(sys.argv[1:] or ["copy_rotations", "nkn"])
