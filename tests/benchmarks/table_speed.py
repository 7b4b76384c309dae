"""How long the table and the comparison of many results take: 2,000 cases x 12 methods x every value.

    python tests/benchmarks/table_speed.py [--cases 2000] [--methods 12]

Writes made-up results in the project's format to a temporary folder, then times, each in a process of its
own and imports included: ``bench table --all`` (means, intervals, ranks), ``bench compare --all`` of two
methods, and as a peer reading the same rows with pandas' defaults and ``groupby`` down to means, which
gives no interval, rank or comparison. Wall and processor seconds, the median of three.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np
from tqdm import tqdm

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from retarget_bench.api import CaseInfo, Value  # noqa: E402
from retarget_bench.plugins import bound, registry  # noqa: E402
from retarget_bench.plugins.bound import declared_values  # noqa: E402
from retarget_bench.results import store  # noqa: E402
from retarget_bench.results.header import SCHEMA, DeclaredValue, parsed  # noqa: E402
from retarget_bench.results.store import CaseResult, ResultPaths  # noqa: E402

CLIPS, REPEATS = 106, 3
POINTS, JOINTS = [f"{0.01 * n:g}" for n in range(7)], [f"joint_{n}" for n in range(22)]
PEER = """
import sys, glob, pandas as pd
for path in glob.glob(sys.argv[1] + '/*/*/*/cases.csv'):
    folder = path[: -len('cases.csv')]
    clips = pd.read_csv(path).set_index('case')['clip']
    for rows in glob.glob(folder + 'method_*.csv'):
        table = pd.read_csv(rows, keep_default_na=False)
        table['clip'] = table['case'].map(clips)
        per_clip = table.groupby(['value_id', 'index', 'clip'])['value'].mean()
        print(per_clip.groupby(['value_id', 'index']).mean())
"""


def declared() -> dict[str, Value]:
    """Every value of every metric of single cases that is installed."""
    names = tuple(entry.name for entry in registry.names("metrics"))
    return declared_values(bound.metrics(names).built)


def made_up(random: np.random.Generator, value: Value) -> float | dict[str, float]:
    """A number, or one per point of a curve or joint."""
    points = {"": [], "joint": JOINTS, "frame": []}.get(value.index, POINTS)
    if value.index:
        return dict(zip(points, random.lognormal(size=len(points)).tolist(), strict=True))
    return float(random.lognormal())


def write(root: Path, cases: int, methods: int) -> int:
    """Results of so many methods; returns the number of rows."""
    values = declared()
    infos = [
        CaseInfo(f"made_up/a>b{n // CLIPS}/clip {n % CLIPS}", "retarget", "cross", "a", f"b{n // CLIPS}",
                 f"clip {n % CLIPS}", "walk", 100)
        for n in range(cases)
    ]  # fmt: skip
    counts = {"asked": cases, "ok": cases, "unsupported": 0, "invalid": 0, "failed": 0, "missing": 0}
    for number in tqdm(range(methods), desc="writing", disable=None):
        random = np.random.default_rng(number)
        method = {"name": f"method_{number}", "label": f"method_{number}", "control": False}
        header = {
            "schema": SCHEMA,
            "keys": {},
            "method": method | {"privileged": [], "stochastic": False},
            "dataset": {"name": "made_up", "label": "made up", "content": "1", "notes": []},
            "metrics": {},
            "values": {key: asdict(DeclaredValue.of(value, "")) for key, value in values.items()},
            "counts": counts,
            "problems": [],
            "seeds": [0],
        }
        entries = [
            CaseResult(info.id, "ok", values={key: made_up(random, value) for key, value in values.items()})
            for info in infos
        ]
        place = ResultPaths(root, "made_up", "retarget", "cross", method["name"])
        store.write_results(place, parsed(header), entries, infos)
    return sum(path.read_bytes().count(b"\n") - 1 for path in root.rglob("method_*.csv"))


def seconds(command: list[str]) -> tuple[float, float]:
    """Wall and processor seconds of a process, medians."""
    taken = []
    for _ in range(REPEATS):
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
        wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        work = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        taken.append((wall, work))
    walls, works = zip(*taken, strict=True)
    return statistics.median(walls), statistics.median(works)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--methods", type=int, default=12)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "runs"
        rows = write(root, given.cases, given.methods)
        print(f"{given.cases} cases x {given.methods} methods, {len(declared())} values: {rows} rows")
        bench = [sys.executable, "-m", "retarget_bench"]
        pair = ["method_0", "method_1", "--results", str(root), "--all"]
        for name, command in {
            "bench table --all": [*bench, "table", str(root), "--all"],
            "bench compare --all": [*bench, "compare", *pair],
            "pandas, means only": [sys.executable, "-c", PEER, str(root)],
        }.items():
            wall, work = seconds(command)
            print(f"  {name:<22} {wall:6.2f} s, {work:6.2f} s of processor time")


if __name__ == "__main__":
    main()
