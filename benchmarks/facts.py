"""The facts by which two revisions are compared: what each does, asked through its own command line.

A kind of facts is a function of a ``Revision`` that yields ``(fact, value)``: the fact's name has
parts, as in ``rows / main / cross / ik / puppets/ada>boulder/sit-001 / mpjpe_h.world``, the value is
text. No code of either revision is imported here; where a later one has other commands or other files,
this file knows both spellings.
"""

import csv
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

Fact = tuple[tuple[str, ...], str]
Facts = Iterator[Fact]

UNTRAINED = ("copy_rotations", "copy_rotations[root_rule=none]", "bone_directions", "ik")
TRAINED = (
    *("nkn", "nkn_cross", "pmnet", "pmnet_cross", "smrm", "pan", "humot", "san", "r2et", "same", "paired"),
    *("npt", "skr", "skin"),
)
STEPS = 20
"""Training steps of every method."""
TOGETHER = 50
"""Files that one ``bench doctor`` is given."""
ABLATIONS = (("humot", "losses"), ("smrm", "table2"), ("smrm", "table3"), ("pan", "table5"))
PAPERS = (
    *(f"correspondence-free-table{number}" for number in range(2, 8)),
    "correspondence-free-text",
    *(f"humot-table{number}" for number in range(2, 6)),
    "humot-text",
    *(f"pan-table{number}" for number in range(1, 5)),
    "pan-text",
)
SEEDS = '''
"""Says the seed of every case by where its answer stands."""
import numpy as np
from retarget_bench.api import MethodCard


class SeedTold:
    card = MethodCard(name="seed_told", summary="Stands where its seed says", version="1", stochastic=True)

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        rotations = np.zeros((source.frames, len(target.skeleton.names), 4))
        rotations[..., 0] = 1.0
        root = np.zeros((source.frames, 3))
        root[:, 0] = (context.seed % 1_000_003) / 1_000_003
        return target.motion(rotations, root, source.fps)


plugin = SeedTold
'''


@dataclass(frozen=True)
class Revision:
    """A revision of the project that can be run.

    tree: its files. python: the interpreter of its environment. scratch: a folder for what its commands
    write.
    data: the folder of motion of others, None where there is none.
    """

    tree: Path
    python: Path
    scratch: Path
    data: Path | None = None

    def bench(self, *words: str | Path, fails: bool = False) -> str:
        """The output of a command. Raises RuntimeError where it fails, unless it is one that may."""
        command = [str(self.python), "-m", "retarget_bench", *map(str, words)]
        alone = {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(self.tree), "COLUMNS": "100"}
        cache = {"RETARGET_BENCH_CACHE": str(self.scratch.parent / "cache")}
        self.scratch.mkdir(parents=True, exist_ok=True)
        completed = subprocess.run(
            command, env=os.environ | alone | cache, cwd=self.scratch, capture_output=True, text=True
        )
        if completed.returncode and not fails:
            output = completed.stdout[-2000:] + completed.stderr[-2000:]
            raise RuntimeError(f"{shlex.join(command)} in {self.tree}:\n{output}")
        return completed.stdout + completed.stderr * fails

    def run(self, name: str, *words: str | Path, command: tuple[str, ...] = ("run",)) -> Path:
        """A folder of results, computed once."""
        folder = self.scratch / name
        if not (folder / "whole").exists():
            self.bench(*command, *words, "--out", folder, "-j", "1")
            (folder / "whole").touch()
        return folder

    @property
    def twenty_commands(self) -> bool:
        """True from when tasks are options of ``bench run`` and plug-ins are named by their files."""
        return (self.tree / "retarget_bench" / "options.py").exists()

    @property
    def turns_arms_out(self) -> bool:
        """True from when ``bench retarget`` turns arms out of the body unless it is told to keep them."""
        return (self.tree / "retarget_bench" / "motion" / "editing" / "arms.py").exists()

    @cached_property
    def main_job(self) -> Path:
        return self.run("main")

    def at(self, name: str) -> "Revision":
        """The same with a scratch folder of its own."""
        return replace(self, scratch=self.scratch / name)


# --------------------------------------------------------------------------------- folders of results
def rows(name: str, folder: Path) -> Facts:
    """Every number of a results folder, with counts of cases and reasons of those without an answer."""
    for path in sorted(folder.glob("*/*/*/*.json")):
        split, method = path.parent.name, path.stem
        header = json.loads(path.read_text("utf-8"))
        head = ("rows", name, _task(path), split, method)
        yield (*head, "label"), str(header["method"]["label"])
        yield (*head, "counts"), json.dumps(header["counts"], sort_keys=True)
        yield (*head, "problems"), json.dumps(header["problems"], sort_keys=True)
        for row in _csv(path.with_suffix(".csv")):
            yield (*head, row["case"], row["value_id"], row["index"]), row["value"]
        sets = path.with_suffix(".sets.csv")
        for row in _csv(sets) if sets.exists() else ():
            for column in ("n", "clips", "value", "low", "high", "floor", "real", "reason"):
                yield (*head, f"set {row['structure']}", row["value_id"], column), row[column]
    for path in sorted(folder.glob("*/*/*/*.journal")):
        head = ("rows", name, _task(path), path.parent.name, path.stem)
        for line in path.read_text("utf-8").splitlines()[1:]:
            entry = json.loads(line)
            yield (*head, entry["case"], "status"), f"{entry['status']} {entry['message']}"
            for value, number in entry["values"].items():
                for index, each in number.items() if isinstance(number, dict) else (("", number),):
                    yield (*head, entry["case"], value, str(index)), repr(each)


def cases(name: str, folder: Path) -> Facts:
    """The case lists of a results folder, in their order."""
    for path in sorted(folder.glob("*/*/*/cases.csv")):
        for number, row in enumerate(_csv(path)):
            yield ("cases", name, _task(path), path.parent.name, str(number)), " ".join(row.values())


def _task(path: Path) -> str:
    """The task of a file of results, without the hash of its parameters."""
    return re.sub("-[0-9a-f]{8}$", "", path.parent.parent.name)


def table(head: tuple[str, ...], text: str, keys: tuple[str, ...]) -> Facts:
    """The cells of a table as CSV; rows are told apart by some columns, and by their order where these
    agree."""
    counts: dict[tuple[str, ...], int] = {}
    for row in csv.DictReader(text.splitlines()):
        key = tuple(row[each] for each in keys)
        counts[key] = counts.get(key, 0) + 1
        for column, value in row.items():
            if column not in keys:
                yield (*head, *key, str(counts[key]), str(column)), value


def _csv(path: Path) -> Iterator[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        yield from csv.DictReader(file)


# --------------------------------------------------------------------------------------------------- kinds
def main_job(revision: Revision) -> Facts:
    """Rows and case lists of the main job."""
    yield from rows("main", revision.main_job)
    yield from cases("main", revision.main_job)


def quick_rows(revision: Revision) -> Facts:
    """Rows of a part of it."""
    folder = revision.run("quick", "copy_rotations", "ik", "pan", "-s", "cross")
    yield from rows("quick", folder)
    yield from cases("quick", folder)


def compared(revision: Revision) -> Facts:
    """Differences, intervals and p-values of pairs of methods on every split."""
    pairs = (("ik", "copy_rotations"), ("ik", "pan"), ("humot", "pan"), ("nkn", "smrm"), ("r2et", "pmnet"))
    for first, second in pairs:
        yield from _compared(revision, revision.main_job, first, second)


def quick_compared(revision: Revision) -> Facts:
    """Those of one pair on one split."""
    folder = revision.run("quick", "copy_rotations", "ik", "pan", "-s", "cross")
    yield from _compared(revision, folder, "ik", "pan")


def _compared(revision: Revision, folder: Path, first: str, second: str) -> Facts:
    text = revision.bench("compare", first, second, "--results", folder, "--all", "-f", "csv")
    yield from table(("compare",), text, ("dataset", "split", "first", "second", "value"))


def mixamo(revision: Revision) -> Facts:
    """Rows of untrained methods on Mixamo."""
    assert revision.data is not None
    folder = revision.run("mixamo", *UNTRAINED, "-d", "mixamo", "--root", revision.data / "mixamo_san")
    yield from rows("mixamo", folder)
    yield from cases("mixamo", folder)


def tasks(revision: Revision) -> Facts:
    """Rows of the derived tasks, of sources that are points, and of people with dogs; eight motions
    each."""
    for task in ("reconstruct", "denoise", "joint-completion"):
        if revision.twenty_commands:
            folder = revision.run(task, "--task", f"{task}[motions=8]")
        else:
            folder = revision.run(task, "--motions", "8", command=("task", task))
        yield from rows(task, folder)
    yield from rows("points", revision.run("points", "--task", "points", "--limit", "8"))
    if revision.data is not None:
        methods = ("copy_rotations", "ik", "other_clip")
        dogs = ("lafan_dog", "--root", revision.data, "--limit", "8")
        yield from rows("dogs", revision.run("dogs", *methods, "-d", *dogs))


def papers(revision: Revision) -> Facts:
    """Published tables with the numbers of the main job, and of Mixamo, beside them."""
    folders = [revision.main_job]
    if revision.data is not None:
        folders.append(
            revision.run("mixamo", *UNTRAINED, "-d", "mixamo", "--root", revision.data / "mixamo_san")
        )
    for folder in folders:
        for paper in PAPERS:
            where = ("-r", folder) if revision.twenty_commands else (folder,)
            text = revision.bench("table", *where, "--paper", paper, "-f", "csv", fails=True)
            head = ("paper", folder.name, paper)
            if text.startswith(("dataset", '"dataset"')):
                yield from table(head, text, ("dataset", "split", "method", "not_ranked"))
            else:
                yield head, _without_paths(revision, text)


def ablations(revision: Revision) -> Facts:
    """Rows of the ablations, after two steps each."""
    for method, name in ABLATIONS:
        out = revision.scratch / f"ablate-{method}-{name}"
        words = ("--preset", "quick", "--budget", "2it", "--out", out, "-j", "1", "--device", "cpu")
        if revision.twenty_commands:
            revision.bench("ablate", method, name, "-d", "puppets", *words)
            text = (out / f"{method}-{name}.csv").read_text("utf-8")
        else:
            text = revision.bench("ablate", method, name, "-d", "puppets", "-f", "csv", *words)
            text = text[text.index('"dataset"') :]
        yield from table(("ablation", method, name), text, ("dataset", "split", "method"))


def seeds(revision: Revision) -> Facts:
    """Seeds of cases, two to a case: rows of a method that stands where its seed says."""
    plugin = revision.scratch / "seed_told.py"
    revision.scratch.mkdir(parents=True, exist_ok=True)
    plugin.write_text(SEEDS)
    words = ("-s", "cross", "--seeds", "2")
    if revision.twenty_commands:
        folder = revision.run("seeds", plugin, *words, "--metrics", "position")
    else:
        folder = revision.run("seeds", "seed_told", *words, "-m", "position", "--plugin", plugin)
    yield from rows("seeds", folder)


def training(revision: Revision) -> Facts:
    """The losses of the first steps of every method, and a hash of the weights that training goes on
    from."""
    for method in TRAINED:
        yield from _steps(revision, method, STEPS)


def quick_training(revision: Revision) -> Facts:
    """Those of two steps of one method."""
    yield from _steps(revision, "pan", 2)


def _steps(revision: Revision, method: str, steps: int) -> Facts:
    out = revision.scratch / f"train-{method}-{steps}"
    words = ("--preset", "quick", "--budget", f"{steps}it", "--out", out, "-j", "1", "--device", "cpu")
    if not (out / "weights.json").exists():
        shutil.rmtree(out, ignore_errors=True)  # what an interrupted comparison left
        revision.bench("train", method, "-d", "puppets", *words)
    head = ("training", method)
    for row in _csv(out / "log.csv"):
        for column, value in row.items():
            if column not in ("step", "seconds"):
                yield (*head, f"step {row['step']}", column), value
    yield (*head, "weights"), _tensors(next(out.glob("step-*.safetensors")), "modules/")


def _tensors(path: Path, prefix: str) -> str:
    """Hash of the tensors of a safetensors file whose names begin with a prefix, whatever else they are
    called."""
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    header: Mapping[str, Any] = json.loads(data[8 : 8 + size])
    hashes = [
        hashlib.sha256(
            data[8 + size + each["data_offsets"][0] : 8 + size + each["data_offsets"][1]]
        ).hexdigest()
        for name, each in header.items()
        if name.startswith(prefix)
    ]
    return hashlib.sha256("".join(sorted(hashes)).encode()).hexdigest()[:16]


def retargeted(revision: Revision) -> Facts:
    """Bytes of retargeted files with arms as the method leaves them, and verdicts on them."""
    assert revision.data is not None
    sources = (
        *("lafan1/Lafan1_example.bvh", "cmu_bvh/01_01.bvh", "cmu_asfamc/02_01.amc"),
        *("bandai_namco/dataset-1_bow_normal_001.bvh", "mixamo_r2et/Mousey"),
    )
    targets = ("gltf/Xbot.glb", "gltf/Soldier.glb", "cmu_bvh/01_01.bvh", "lafan1/std.bvh")
    folder = revision.scratch / "retargeted"
    folder.mkdir(parents=True, exist_ok=True)
    files = [_file(revision.data / each) for each in targets]
    for source in map(_file, (revision.data / each for each in sources)):
        for target in files:
            pair = f"{source.stem} to {target.stem}"
            out, report = folder / f"{pair}{target.suffix}", folder / f"{pair}.json"
            words = ("--target", target, "-o", out, "--report", report, "--quiet", "--overwrite")
            words += ("--arms", "keep") * revision.turns_arms_out
            text = revision.bench("retarget", source, *words, fails=True)
            if not out.exists():
                yield ("retarget", pair), _without_paths(revision, text)
                continue
            yield ("retarget", pair), hashlib.sha256(out.read_bytes()).hexdigest()
            for fact, value in _flat(json.loads(report.read_text("utf-8"))):
                yield ("verdict", pair, *fact), _without_paths(revision, value)


def _file(path: Path) -> Path:
    """A file, or the shortest of a folder."""
    if path.is_file():
        return path
    return min((each for each in path.rglob("*.bvh")), key=lambda each: (each.stat().st_size, each.name))


def doctor(revision: Revision) -> Facts:
    """The findings of ``bench doctor`` in all files of motion."""
    assert revision.data is not None
    endings = {".bvh", ".glb", ".gltf", ".amc", ".fbx", ".npz", ".npy", ".vrm"}
    files = sorted(
        p for p in revision.data.rglob("*") if p.suffix.lower() in endings and "oracles" not in p.parts
    )
    for first in range(0, len(files), TOGETHER):
        counts = {str(path.relative_to(revision.data)): 0 for path in files[first : first + TOGETHER]}
        text = _without_paths(
            revision, revision.bench("doctor", *files[first : first + TOGETHER], fails=True)
        )
        name = ""
        for line in text.splitlines():
            name = line.removeprefix("DATA/") if line.removeprefix("DATA/") in counts else name
            counts[name] = counts.get(name, 0) + 1
            yield ("doctor", name, str(counts[name])), line.strip()


def _flat(content: Any, head: tuple[str, ...] = ()) -> Facts:
    """The leaves of what a JSON file holds."""
    pairs = (
        content.items()
        if isinstance(content, dict)
        else enumerate(content)
        if isinstance(content, list)
        else None
    )
    if pairs is None:
        yield head, json.dumps(content)
        return
    for key, value in pairs:
        yield from _flat(value, (*head, str(key)))


def _without_paths(revision: Revision, text: str) -> str:
    for folder, name in ((revision.scratch, "SCRATCH"), (revision.data, "DATA"), (revision.tree, "TREE")):
        text = text.replace(str(folder), name) if folder else text
    return re.sub(r"\s+\n", "\n", text).strip()


Kind = Callable[[Revision], Facts]
QUICK: tuple[Kind, ...] = (quick_rows, quick_compared, quick_training)
FULL: tuple[Kind, ...] = (main_job, compared, tasks, seeds, training, ablations, papers)
WITH_DATA: tuple[Kind, ...] = (mixamo, retargeted, doctor)
