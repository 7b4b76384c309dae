"""What FID notices: FID and its kin of real motion that was made worse in known ways, over the floor.

    python benchmarks/fid_sensitivity.py --takes FOLDER --takes FOLDER --mixamo DIR      FID of people
    python benchmarks/fid_sensitivity.py --structure body22 --structure dog21            values by structure

Prints a table in Markdown. Without --structure: people of the main job's cross split, of the Mixamo
clips and of folders of BVH files.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "metrics"))
from corruptions import HARMS, Crowd, people_in, seen, structure_in

from retarget_bench.plugins import registry

STRUCTURE_VALUES = ("fid.structure", "kid", "coverage", "density")


def main() -> None:
    """Print a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--takes", type=Path, action="append", default=[], help="a folder of BVH files")
    parser.add_argument("--mixamo", help="folder of the Mixamo clips")
    parser.add_argument("--structure", action="append", help="of puppets[size=default]")
    parser.add_argument("--performances", type=int, default=160, help="of a structure, at most")
    options = parser.parse_args()
    if options.structure:
        by_structure(options.structure, options.performances)
        return
    crowds = dict(_crowds(options.takes, options.mixamo))
    if empty := [title for title, crowd in crowds.items() if not crowd.sets().n]:
        parser.error(f"{empty[0]}: no BVH file with motion of people of a second and a half or more")
    people(crowds)


def people(crowds: dict[str, Crowd]) -> None:
    """FID by harm, a column for each set of motions, as multiples of the floor."""
    print("| harm |", *(f"{title} |" for title in crowds))
    print("|---|", *("---|" for _ in crowds))
    print("| windows in each half |", *(f"{crowd.sets().n} |" for crowd in crowds.values()))
    print("| floor |", *(f"{crowd.notice():.2f} |" for crowd in crowds.values()))
    rows = {**HARMS, "another clip": (None, (1.0,))}
    for name, (harm, amounts) in tqdm(rows.items(), leave=False, disable=None):
        cells = []
        for crowd in crowds.values():
            pairs = [crowd.times(harm or crowd.other_clip, amount) for amount in amounts]
            cells.append(", ".join(f"{harmed / floor:.2f}" for harmed, floor in pairs))
        text = "" if len(amounts) == 1 and amounts[0] == 1 else ": " + ", ".join(f"{x:g}" for x in amounts)
        print(f"| {name}{text} |", *(f"{cell} |" for cell in cells), flush=True)


def by_structure(structures: list[str], performances: int) -> None:
    """All values by structure, harm and amount."""
    puppets = registry.create("datasets", "puppets[size=default]")
    print("| structure | harm | amount | n |", *(f"{value} |" for value in STRUCTURE_VALUES))
    print("|---|---|---|---|", *("---|" for _ in STRUCTURE_VALUES))
    known = sorted({body.structure for body in puppets.characters().values()})
    if unknown := sorted(set(structures) - set(known)):
        raise SystemExit(f"fid_sensitivity.py: no structure {unknown[0]}; there are {', '.join(known)}")
    for structure in structures:
        crowd = structure_in(puppets, structure, performances)
        rows = [("none: the floor", None, 0.0)]
        rows += [(name, harm, amount) for name, (harm, amounts) in HARMS.items() for amount in amounts]
        for name, harm, amount in tqdm(rows, desc=structure, leave=False, disable=None):
            numbers = [crowd.notice(harm, amount, value) for value in STRUCTURE_VALUES]
            n = crowd.sets(harm, amount).n
            print(
                f"| {structure} | {name} | {amount:g} | {n} |", *(f"{x:.3f} |" for x in numbers), flush=True
            )


def _crowds(takes: list[Path], mixamo: str | None) -> Iterator[tuple[str, Crowd]]:
    specs = {"main job": "puppets[size=tiny]"} | ({"Mixamo": f"mixamo[root={mixamo}]"} if mixamo else {})
    for title, spec in specs.items():
        data = registry.create("datasets", spec)
        cast = data.characters()
        infos = {
            info.clip: info for info in data.cases("retarget", "cross") if not cast[info.target].four_legged
        }
        yield title, Crowd({(clip, ""): seen(data.load(info).reference) for clip, info in infos.items()})
    for folder in takes:
        yield folder.name, people_in(folder)


if __name__ == "__main__":
    main()
