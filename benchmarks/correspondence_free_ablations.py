"""Tables 2 and 3 of the correspondence-free paper with the whole pipeline: L_rot, and temporal context.

    python benchmarks/correspondence_free_ablations.py --steps 2000

Trains SMRM once for every row below --out, a run after the other, each from random weights on the same
data, for as many steps and with the same seed, so that other work on the machine changes nothing; what was
begun goes on, and more steps go on from the runs that are there. With each of them the pipeline answers
points of held-out puppets, with the same SKR and SKIN. Writes the part "Ablations" of
``results/correspondence_free.md``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import held_out_cases as cases
import torch

from retarget_bench.api import Ablation
from retarget_bench.evaluation import plan
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Scalar, Spec
from retarget_bench.python.ablations import published
from retarget_bench.training import run_folder

PAGE = Path(__file__).parents[1] / "results" / "correspondence_free.md"
TRAINED = "puppets[size=default,bodies=200]"
TESTED = "puppets[size=default]"


def train(method: Spec, folder: Path, options: argparse.Namespace) -> int:
    """Train SMRM up to so many steps, and return them. Raises SystemExit where training fails."""
    begun = run_folder.read(folder)
    if begun is None or begun.steps < options.steps:
        new = [str(method), *(f"-d{each}" for each in options.dataset), "--precision", options.precision]
        arguments = ["--resume"] if begun else [*new, "--jobs", "1", "--seed", str(options.seed)]
        command = [sys.executable, "-m", "retarget_bench", "train", *arguments]
        complete = [*command, "--budget", f"{options.steps}it", "--out", str(folder)]
        if subprocess.run(complete, check=False).returncode:
            raise SystemExit(f"{method}: training ended with an error, see above")
    trained = run_folder.read(folder)
    return trained.steps if trained else 0


def lines(
    ablation: Ablation, results: Mapping[Spec, cases.Numbers], infos: Any, steps: Mapping[Spec, int]
) -> Iterator[str]:
    """A table of the paper, ours under each printed row, and each row's difference from ours."""
    table = published(ablation)
    columns = {column.value_id: column.label for column in table.columns}
    yield from ("", f"### {table.source}", "")
    yield from cases.heading("row")
    for label, changed in ablation.rows.items():
        spec = spec_of(changed)
        printed = [table.rows[label][columns[value]].text for value in cases.COLUMNS]
        yield cases.row(f"{label} (printed)", printed)
        values = [cases.shown(cases.means(results[spec], infos, value)) for value in cases.COLUMNS]
        yield cases.row(f"{label}, {steps[spec]} steps", values)
    yield from ("", "Difference from `smrm` as it is (with L_rot, 30 frames), case by case:", "")
    yield from cases.heading("row")
    base = results[Spec("smrm")]
    for label, changed in ablation.rows.items():
        if (spec := spec_of(changed)) != Spec("smrm"):
            apart = [
                cases.mean([results[spec][i.id][value] - base[i.id][value] for i in infos], infos)
                for value in cases.COLUMNS
            ]
            yield cases.row(label, [cases.shown(one) for one in apart])


def spec_of(changed: Mapping[str, Scalar]) -> Spec:
    return registry.canonical("methods", Spec("smrm", changed))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--steps", type=int, default=2000, metavar="N", help="of training, each row (2000)")
    parser.add_argument("-d", "--dataset", action="append", metavar="DATASET", help="to train on")
    parser.add_argument("--precision", default="bfloat16", help="of matrix products in training (bfloat16)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of weights and batches (0)")
    parser.add_argument("--clips", type=int, default=30, metavar="N", help="of each split to test on (30)")
    parser.add_argument("--skr", default="puppets", metavar="WEIGHTS", help="of SKR, shipped or a path")
    parser.add_argument("--skin", default="puppets", metavar="WEIGHTS", help="of SKIN, shipped or a path")
    parser.add_argument("--out", type=Path, default=Path("runs/correspondence_free"), metavar="DIR")
    options = parser.parse_args()
    torch.set_num_threads(1)
    ablations: Mapping[str, Ablation] = registry.create("methods", "smrm").ablations
    options.dataset = options.dataset or [TRAINED]
    specs = list(dict.fromkeys(spec_of(row) for each in ablations.values() for row in each.rows.values()))
    steps, results = {}, {}
    for spec in specs:
        steps[spec] = train(spec, options.out / spec.slug, options)
    data = plan.data_of(bound.dataset(Spec.parse(TESTED)), cases.TASK)
    infos = cases.held_out(data, options.clips)
    for spec in specs:
        stages = {"skr": options.skr, "skin": options.skin, "smrm": str(options.out / spec.slug)}
        full = registry.canonical("methods", Spec("correspondence_free", stages))
        file = options.out / "scores" / f"{spec.slug}.jsonl"
        results[spec] = cases.scored(full, data, infos, file)
    text = [
        "    python benchmarks/correspondence_free_ablations.py "
        f"--steps {options.steps} {' '.join(f'-d {each!r}' for each in options.dataset)}",
        "",
        f"SMRM was trained for {options.steps} steps for every row, from random weights, "
        f"on `{'` and `'.join(options.dataset)}`, seed {options.seed}, in {options.precision}; "
        "SKR and SKIN are the same in all of them. The "
        f"whole pipeline answered points of `{TESTED}`: {cases.size(infos)} that no training has seen. "
        "Metres, and metres per squared frame of 30 per second; means over clips, 95 % intervals over "
        "clips in brackets. One training of each row: how another seed would change it the intervals do "
        "not say. Printed numbers are on 4 SMPL bodies x 4 Mixamo motions: how rows differ can be "
        "compared, the numbers cannot.",
    ]
    for each in ablations.values():
        text += lines(each, results, infos, steps)
    cases.write_part(PAGE, "Ablations", text)
    print("\n".join(text))


if __name__ == "__main__":
    main()
