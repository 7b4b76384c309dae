"""The numbers that differ between two revisions, and whether each difference is named.

    python benchmarks/same_numbers.py 2a4e1f43 HEAD --quick      a minute
    python benchmarks/same_numbers.py 2a4e1f43 HEAD --data DIR   everything: about an hour

Both revisions are checked out, get environments of their own, and are run side by side; what they say
is compared fact by fact (``benchmarks/facts.py``). A difference is

- *renamed*, if ``benchmarks/renamed.csv`` says that a part of the fact's name is called otherwise now;
- *named*, if a pattern in ``results/CHANGES.md`` of the later revision fits the fact: under "Numbers that
  moved", a line begins with the pattern in backquotes and says why;
- else *unnamed*: the exit status is 1 then. A fact that is gone is a difference; one that is new is none.

Checkouts, environments and facts lie in ``build/same_numbers`` and are used again: facts of a revision
are computed once on a machine. Delete the folder to begin anew (and run ``git worktree prune``).
"""

import argparse
import csv
import fnmatch
import hashlib
import re
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import facts
from facts import Kind, Revision

ROOT = Path(__file__).resolve().parents[1]
WORK = ROOT / "build" / "same_numbers"
RENAMED = ROOT / "benchmarks" / "renamed.csv"
CHANGES = "results/CHANGES.md"
FACTS_HASH = hashlib.sha256(Path(facts.__file__).read_bytes()).hexdigest()[:8]
"""Facts that were asked otherwise are asked anew."""
EXAMPLES = 3
"""Differences written out of each group that is told in one line."""
SEPARATOR = " / "

Values = Mapping[tuple[str, ...], str]


def main() -> int:
    """Compare two revisions; 0: nothing is unnamed, 1: something is, 2: one of them could not be asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("old", help="the revision to compare with")
    parser.add_argument("new", help="the later revision; what is not committed does not count")
    parser.add_argument(
        "--quick", action="store_true", help="one split of four methods, two steps of training"
    )
    parser.add_argument("--data", type=Path, help="folder of motion of others, for what is computed on it")
    parser.add_argument("--only", action="append", help="only facts of this kind; may be repeated")
    options = parser.parse_args()
    data = options.data.resolve() if options.data else None
    if data is not None and not data.is_dir():
        parser.error(f"{data} is no folder")
    kinds = facts.QUICK if options.quick else (*facts.FULL, *(facts.WITH_DATA if data else ()))
    offered = {kind.__name__: kind for kind in kinds}
    if unknown := [name for name in options.only or () if name not in offered]:
        parser.error(f"there are no facts {unknown[0]!r} here, but {', '.join(offered)}")
    kinds = tuple(kind for name, kind in offered.items() if not options.only or name in options.only)
    started = time.perf_counter()
    try:
        old, new = (revision(name, data) for name in (options.old, options.new))
        with ThreadPoolExecutor(2) as pool:
            both = list(pool.map(lambda each: collected(each, kinds), (old, new)))
    except (RuntimeError, subprocess.CalledProcessError) as error:
        print(f"same_numbers: {error}", file=sys.stderr)
        return 2
    unnamed = 0
    for kind, before, after in zip(kinds, *both, strict=True):
        comparison = compare(before, after, renames(kind.__name__), patterns(new.tree / CHANGES))
        unnamed += len(comparison.unnamed)
        print(comparison.text(kind.__name__), flush=True)
    seconds = time.perf_counter() - started
    print(f"{unnamed or 'no'} unnamed difference{'s' * (unnamed != 1)} ({seconds:.0f} s)")
    return int(unnamed > 0)


# --------------------------------------------------------------------------------------------------
# revisions
def revision(name: str, data: Path | None) -> Revision:
    """A revision's checkout, with an environment that it shares with revisions of equal requirements."""
    try:
        sha = _git("rev-parse", f"{name}^{{commit}}")[:12]
    except subprocess.CalledProcessError:
        raise RuntimeError(f"{name!r} is no revision of this repository") from None
    tree = WORK / sha / "tree"
    if not tree.exists():
        _git("worktree", "prune")
        _git("worktree", "add", "--detach", str(tree), sha)
    requirements = "".join((tree / each).read_text() for each in ("pyproject.toml", "constraints.txt"))
    environment = WORK / f"environment-{hashlib.sha256(requirements.encode()).hexdigest()[:12]}"
    subprocess.run(
        ["make", "--quiet", f"VENV={environment}", f"{environment}/installed-test"],
        cwd=tree,
        check=True,
        stdout=sys.stderr,
    )
    return Revision(tree, environment / "bin" / "python", WORK / sha / "scratch", data)


def _git(*words: str) -> str:
    return subprocess.run(
        ["git", *words], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.strip()


def collected(revision: Revision, kinds: Sequence[Kind]) -> list[Values]:
    """The facts of every kind, from files where they were computed before."""
    by_kind: list[Values] = []
    for kind in kinds:
        path = revision.scratch.parent / f"{kind.__name__}-{FACTS_HASH}.csv"
        if not path.exists():
            started = time.perf_counter()
            lines = [(SEPARATOR.join(fact), value) for fact, value in kind(revision)]
            unfinished = path.with_suffix(".unfinished")
            with unfinished.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows(lines)
            unfinished.replace(path)
            seconds = time.perf_counter() - started
            print(
                f"{revision.tree.parent.name} {kind.__name__}: {seconds:.0f} s", file=sys.stderr, flush=True
            )
        with path.open(newline="", encoding="utf-8") as file:
            by_kind.append({tuple(fact.split(SEPARATOR)): value for fact, value in csv.reader(file)})
    return by_kind


# --------------------------------------------------------------------------------------------------
# comparing
@dataclass
class Comparison:
    """Facts by what became of them; those that differ as (name, before, now)."""

    same: int = 0
    renamed: int = 0
    new: int = 0
    named: dict[str, list[tuple[str, str, str]]] = field(default_factory=lambda: defaultdict(list))
    unnamed: list[tuple[str, str, str]] = field(default_factory=list)

    def text(self, kind: str) -> str:
        """A line of counts, a line for each pattern that named something, and what nothing named."""
        named = sum(map(len, self.named.values()))
        counts = f"{self.same:,} same, {self.renamed:,} renamed, {self.new:,} new, {named:,} named"
        lines = [f"{kind}: {counts}, {len(self.unnamed):,} UNNAMED"]
        lines += [f"  named by {pattern}: {len(each):,}" for pattern, each in self.named.items()]
        groups: dict[str, list[tuple[str, str, str]]] = defaultdict(list)
        for fact, before, now in self.unnamed:
            groups[SEPARATOR.join(fact.split(SEPARATOR)[:5])].append((fact, before, now))
        for head, each in groups.items():
            lines.append(f"  unnamed: {head}: {len(each):,}")
            lines += [
                f"    {fact}: {before!r:.160} -> {now!r:.160}" for fact, before, now in each[:EXAMPLES]
            ]
        return "\n".join(lines)


def compare(before: Values, after: Values, renamed: Mapping[str, str], named: Sequence[str]) -> Comparison:
    """Join the facts of two revisions.

    renamed: a part of a fact's name -> what it is called now. named: patterns of facts that may differ.
    """
    result, matched = Comparison(), set()
    for fact, value in before.items():
        now = tuple(renamed.get(part, part) for part in fact)
        matched.add(now)
        if after.get(now) == value:
            result.same += now == fact
            result.renamed += now != fact
            continue
        name = SEPARATOR.join(fact)
        difference = (name, value, after.get(now, "(gone)"))
        pattern = next((each for each in named if fnmatch.fnmatchcase(name, each)), None)
        (result.unnamed if pattern is None else result.named[pattern]).append(difference)
    result.new = len(set(after) - matched)
    return result


def renames(kind: str) -> dict[str, str]:
    """Parts of the names of facts of a kind -> their present names."""
    with RENAMED.open(newline="", encoding="utf-8") as file:
        return {row["old"]: row["new"] for row in csv.DictReader(file) if row["kind"] in ("", kind)}


def patterns(path: Path) -> list[str]:
    """Patterns of facts that a page of changes names. In a pattern ``*`` is anything, ``[`` is itself."""
    text = path.read_text("utf-8") if path.exists() else ""
    return [each.replace("[", "[[]") for each in re.findall(r"^- `([^`]+ / [^`]+)`", text, re.MULTILINE)]


if __name__ == "__main__":
    sys.exit(main())
