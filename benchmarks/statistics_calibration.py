"""Rates at which intervals cover the truth, equal methods are told apart, and different ones are not.

    python benchmarks/statistics_calibration.py [--repeats 4000] [--only PART] [--rows RUNS]

Errors are simulated as in ``tests/engine/clip_simulation.py``, with the clusters of real results. Beside
what the project uses stand what it could have used: Student's t, the percentile bootstrap, sign flips of
plain means, and asking Wilcoxon's signed ranks to agree. Tables are printed as in results/measurements.md.
``--rows``: draws clips with replacement from real results instead, every method shifted to one mean:
a hard test, since a method that fails on few clips then counts as equal to others.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.special import stdtrit
from scipy.stats import rankdata
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "engine"))

from clip_simulation import OWN, RECKLESS, STEADY, errors, failures

from retarget_bench.analysis import ranking, selection, statistics
from retarget_bench.results import result_matrix, store

CLIPS = (10, 13, 20, 43, 94)
EFFECTS = (0.95, 0.9, 0.8, 0.6)
RESAMPLES = 999
METHODS = 10
"""Of a table."""
REAL_CLIPS = (13, 43, 94)
"""Drawn from real results."""
REAL_VALUES = ("mpjpe_h.world", "mpjpe_h.root", "contact_recall", "foot_slide", "jerk_ratio")
Rows = dict[str, list[str]]


def student(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of Student's t interval of every row."""
    half = stdtrit(rows.shape[1] - 1, 0.975) * rows.std(axis=1, ddof=1) / np.sqrt(rows.shape[1])
    return rows.mean(axis=1) - half, rows.mean(axis=1) + half


def percentile(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the percentile bootstrap of every row."""
    clips = rows.shape[1]
    weights = np.random.default_rng(0).multinomial(clips, np.full(clips, 1 / clips), RESAMPLES) / clips
    low, high = np.quantile(rows @ weights.T, [0.025, 0.975], axis=1)
    return low, high


def shown_interval(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the interval that tables show."""
    intervals = statistics.mean_intervals(rows)
    return np.array([each.low for each in intervals]), np.array([each.high for each in intervals])


def plain_flips(rows: np.ndarray) -> np.ndarray:
    """p-values of sign flips of the sum, not corrected for skew."""
    clips = rows.shape[1]
    signs = statistics._signs(clips, statistics._draws(clips)[0]).astype(float)
    p_values = []
    for some in np.array_split(rows, max(1, len(rows) // 64)):
        sums = np.abs(signs @ some.T)
        p_values.append((sums >= sums[0] * (1 - 1e-9)).mean(axis=0))
    return np.concatenate(p_values)


def agreeing(rows: np.ndarray, p: np.ndarray) -> np.ndarray:
    """p-values of a rule that asks Wilcoxon's signed ranks, too: the larger; 1 where directions differ."""
    ranks = np.sign(rows) * np.maximum(0, rankdata(np.abs(rows), axis=1) - (rows == 0).sum(axis=1)[:, None])
    alike = np.sign(rows.mean(axis=1)) == np.sign(ranks.sum(axis=1))
    return np.where(alike, np.maximum(p, plain_flips(ranks)), 1.0)


def share(p: np.ndarray) -> float:
    """Per cent of p-values that are called a difference."""
    return 100 * float((p < statistics.ALPHA).mean())


def rates(rows: np.ndarray) -> str:
    """Per cent told apart: ours, by flips of plain means, with the signed ranks agreeing."""
    p = statistics.sign_flip(rows)
    return f"{share(p):.1f} / {share(plain_flips(rows)):.1f} / {share(agreeing(rows, p)):.1f}"


def coverage(repeats: int) -> Rows:
    """Per kind of interval: per cent that hold the truth."""
    table: Rows = {"shown in tables": [], "Student's t": [], "percentile bootstrap": []}
    for clips in tqdm(CLIPS, desc="intervals", disable=None):
        (rows,) = errors(np.random.default_rng(clips), repeats, clips, (OWN,))
        for out, method in zip(table.values(), (shown_interval, student, percentile), strict=True):
            low, high = method(rows)
            out.append(f"{100 * float(((low <= 1) & (high >= 1)).mean()):.1f}")
    return table


def equals(random: np.random.Generator, repeats: int, clips: int) -> Iterator[tuple[str, np.ndarray]]:
    """Differences ``(repeats, clips)`` whose expectation is 0, by name."""
    shape = (repeats, clips)
    own, same, steady, reckless = errors(random, repeats, clips, (OWN, OWN, STEADY, RECKLESS))
    yield "normal", random.normal(size=shape)
    yield "heavy tails (Student, 3 degrees)", random.standard_t(3, size=shape)
    yield "both err alike", own - same
    yield "one is steadier", own - steady
    yield "one errs badly on few clips (skewed)", reckless - steady
    yield "recall in fifths, many ties", np.subtract(*random.binomial(5, 0.9, (2, *shape))) / 5
    yield "one fails on 10 % of the clips", own * failures(random, shape, 0.1, 5) - same
    yield "one fails on 4 % of the clips", own * failures(random, shape, 0.04, 10) - same


def alarms(repeats: int) -> Rows:
    """Per null hypothesis: per cent of equal methods told apart."""
    table: Rows = {}
    for clips in tqdm(CLIPS, desc="false alarms", disable=None):
        for name, rows in equals(np.random.default_rng(100 + clips), repeats, clips):
            table.setdefault(name, []).append(rates(rows))
    return table


def hidden(repeats: int) -> Rows:
    """One of two equal methods fails on 4 % of all clips: samples without and with a failure."""
    table: Rows = {"samples without a failure": [], "told apart, of these": [], "of the others": []}
    table["called better without reserve, of all"] = []
    for clips in tqdm(CLIPS, desc="hidden failures", disable=None):
        random = np.random.default_rng(300 + clips)
        own, same = errors(random, repeats, clips, (OWN, OWN))
        factors = failures(random, own.shape, 0.04, 10)
        none = (factors < 1).all(axis=1)
        p = statistics.sign_flip(own * factors - same)
        free = share(p) if clips >= statistics.CLIPS_FOR_RARE else 0.0
        for out, number in zip(
            table.values(), (100 * none.mean(), share(p[none]), share(p[~none]), free), strict=True
        ):
            out.append(f"{number:.1f}")
    return table


def power(repeats: int) -> Rows:
    """Per alternative: per cent of methods that differ told apart."""
    table: Rows = {}
    for clips in tqdm(CLIPS, desc="power", disable=None):
        random = np.random.default_rng(200 + clips)
        first, second = errors(random, repeats, clips, (OWN, OWN))
        for effect in EFFECTS:
            name = f"errors {100 * (1 - effect):.0f} % smaller"
            table.setdefault(name, []).append(rates(first - effect * second))
        worse = np.where(random.random(first.shape) < 0.1, 5.0, 0.9)
        table.setdefault("10 % smaller, but 5-fold on 10 % of the clips", []).append(
            rates(worse * first - second)
        )
    return table


def tables(repeats: int) -> Rows:
    """Per cent of tables of ten methods, of equal expectation, in which somebody is told from the best."""
    table: Rows = {"ten that err alike": [], "five of them three times as bad as the others": []}
    table["one fails on 4 % of the clips"] = []
    for clips in tqdm(CLIPS, desc="tables", disable=None):
        random = np.random.default_rng(400 + clips)
        counts = np.zeros(3)
        for _ in tqdm(range(repeats), leave=False, disable=None):
            means = errors(random, 1, clips, (OWN,) * METHODS)[:, 0]
            scaled = means * np.repeat([1.0, 3.0], METHODS // 2)[:, None]
            fails = means * np.vstack(
                [failures(random, (1, clips), statistics.RARE, 10), np.ones((9, clips))]
            )
            among = ((means, METHODS), (scaled, METHODS // 2), (fails, METHODS))
            counts += [_told_apart(each, equal) for each, equal in among]
        for out, count in zip(table.values(), counts, strict=True):
            out.append(f"{100 * count / repeats:.1f}")
    return table


def _told_apart(means: np.ndarray, equal: int, tolerance: float = 0.0) -> bool:
    """Whether any of the first, equal methods is told from the best of the table."""
    best, p = statistics.against_best(means, tolerance)
    return best < equal and bool((p[:equal] < statistics.ALPHA).any())


def real(root: Path, repeats: int) -> Iterator[tuple[str, list[float]]]:
    """Per split and value of real results on people: per cent of tables of clips drawn with replacement in
    which somebody is told from the best, after every method's numbers are shifted to one mean."""
    for results in selection.of_bodies(result_matrix.result_matrices(store.find_results(root))):
        matrix = selection.without_variants(results)
        among = np.array([not ranking.unranked(row.header) for row in matrix.rows])
        for value in REAL_VALUES:
            if matrix.split == "self" or ranking.doubt(matrix, value):
                continue
            declared = matrix.values[value]
            numbers = matrix.numbers((value, ""))
            common, ranked, _ = ranking.common_cases(numbers, among)
            if ranked.sum() < 2:
                continue
            losses = statistics.losses(numbers[ranked][:, common], declared.better, declared.goal)
            means = statistics.per_clip(losses, matrix.clips[common])
            centred = means - means.mean(axis=1, keepdims=True)
            shares = []
            for clips in REAL_CLIPS:
                drawn = np.random.default_rng(clips).integers(0, centred.shape[1], (repeats, clips))
                told = [_told_apart(centred[:, at], len(means), declared.tolerance) for at in drawn]
                shares.append(100 * float(np.mean(told)))
            yield f"{matrix.split} {value}, {len(means)} methods of {means.shape[1]} clips", shares


PARTS: dict[str, tuple[str, Callable[[int], Rows]]] = {
    "intervals": ("95 % intervals that hold the truth, %", coverage),
    "alarms": ("Equal methods told apart, %: ours / plain flips / signed ranks agreeing", alarms),
    "hidden": ("One of two equal methods fails on 4 % of all clips, %", hidden),
    "power": ("Methods that differ told apart, %: ours / plain flips / signed ranks agreeing", power),
    "tables": (f"Tables of {METHODS} methods in which an equal one is told from the best, %", tables),
}


def show(title: str, rows: Rows) -> None:
    print(f"\n{title}\n\n| clips | " + " | ".join(map(str, CLIPS)) + " |\n|---|" + "---:|" * len(CLIPS))
    for name, cells in rows.items():
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=4000)
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--rows", type=Path)
    options = parser.parse_args()
    if options.rows:
        print("tables with somebody told from the best, %: " + ", ".join(f"{n} clips" for n in REAL_CLIPS))
        for name, shares in real(options.rows, options.repeats):
            print("  " + " ".join(f"{rate:6.1f}" for rate in shares) + f"  {name}", flush=True)
        return
    for name, (title, part) in PARTS.items():
        if options.only in (None, name):
            show(title, part(options.repeats))


if __name__ == "__main__":
    main()
