"""How often intervals cover the truth, equal methods are told apart, and different ones are not.

    python tests/benchmarks/statistics_calibration.py [--repeats 4000] [--picture FILE.png] [--rows RUNS]

Errors are simulated as in ``tests/engine/clip_simulation.py``, with the clusters of real results. Beside
what the project uses stand what it could have used: Student's t, the percentile bootstrap, sign flips of
plain means. ``--rows``: draws clips with replacement from the differences of real results instead,
shifted to a mean of 0: a hard test, since two methods of which one fails on few clips then count as equal.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.special import stdtrit
from tqdm import tqdm

sys.path[:0] = [str(Path(__file__).parents[2]), str(Path(__file__).parents[1] / "engine")]

from clip_simulation import OWN, RECKLESS, STEADY, errors  # noqa: E402

from retarget_bench.analysis import statistics  # noqa: E402
from retarget_bench.results import result_matrix, store  # noqa: E402

CLIPS = (10, 13, 20, 30, 50, 94)
EFFECTS = (0.95, 0.9, 0.8)
RESAMPLES = 999
TABLE_METHODS = (2, 4, 8, 12)
TABLE_REPEATS = 400


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


def ours(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the interval that tables show."""
    found = statistics.mean_intervals(rows)
    return np.array([each.low for each in found]), np.array([each.high for each in found])


def plain_flips(rows: np.ndarray) -> np.ndarray:
    """p-values of sign flips of the mean, not corrected for skew."""
    signs = statistics._signs(rows.shape[1])
    sums = np.abs(signs @ rows.T)
    return (sums >= sums[0] * (1 - 1e-9)).mean(axis=0)


def share(p: np.ndarray) -> float:
    """Per cent of p-values that are called a difference."""
    return 100 * float((p < statistics.ALPHA).mean())


def coverage(repeats: int) -> list[tuple[int, list[float]]]:
    """Per number of clips: per cent of intervals that hold the truth."""
    found = []
    for clips in tqdm(CLIPS, desc="intervals", disable=None):
        (rows,) = errors(np.random.default_rng(clips), repeats, clips, (OWN,))
        ends = [method(rows) for method in (ours, student, percentile)]
        found.append((clips, [100 * float(((low <= 1) & (high >= 1)).mean()) for low, high in ends]))
    return found


def alarms(repeats: int) -> list[tuple[int, list[float]]]:
    """Per number of clips: per cent of equal methods told apart; ours, then flips of plain means."""
    found = []
    for clips in tqdm(CLIPS, desc="false alarms", disable=None):
        own, same, steady, reckless = errors(
            np.random.default_rng(100 + clips), repeats, clips, (OWN, OWN, STEADY, RECKLESS)
        )
        pairs = [own - same, own - steady, reckless - steady]
        rates = [rate(pair) for pair in pairs for rate in (ours_share, plain_share)]
        found.append((clips, rates))
    return found


def ours_share(rows: np.ndarray) -> float:
    return share(statistics.sign_flip(rows))


def plain_share(rows: np.ndarray) -> float:
    return share(plain_flips(rows))


def power(repeats: int) -> list[tuple[int, list[float]]]:
    """Per number of clips: per cent of methods better by 5, 10 and 20 % told apart."""
    found = []
    for clips in tqdm(CLIPS, desc="power", disable=None):
        first, second = errors(np.random.default_rng(200 + clips), repeats, clips, (OWN, OWN))
        found.append((clips, [share(statistics.sign_flip(first - e * second)) for e in EFFECTS]))
    return found


def tables() -> list[tuple[int, list[float]]]:
    """Per number of equal methods, 50 clips: per cent of tables in which any is told from the best."""
    found = []
    for methods in tqdm(TABLE_METHODS, desc="tables", disable=None):
        made = errors(np.random.default_rng(methods), TABLE_REPEATS, 50, (OWN,) * methods)
        all_pairs = best_only = 0
        for number in range(TABLE_REPEATS):
            means = made[:, number]
            best, p = statistics.against_best(means)
            all_pairs += p.min() < statistics.ALPHA
            raw = statistics.sign_flip(np.delete(means, best, axis=0) - means[best])
            best_only += statistics.holm(raw).min() < statistics.ALPHA
        found.append((methods, [100 * all_pairs / TABLE_REPEATS, 100 * best_only / TABLE_REPEATS]))
    return found


def real(root: Path, repeats: int) -> list[tuple[str, list[float]]]:
    """Per value, from pairs of methods: per cent told apart after a shift to a mean of 0."""
    found = []
    for each in result_matrix.result_matrices(store.find_results(root)):
        if each.split == "self" or len(each.rows) < 2:
            continue
        for key in [
            (value, "") for value in ("mpjpe_h.world", "foot_slide", "jerk_ratio", "contact_recall")
        ]:
            numbers = each.numbers(key)
            there = each.own & ~np.isnan(numbers).any(axis=0)
            means = statistics.per_clip(numbers[:, there], each.clips[there])
            for one in range(len(means)):
                for two in range(one):
                    apart = means[one] - means[two]
                    if apart.std() <= 1e-6:
                        continue
                    centred = apart - apart.mean()
                    rates = []
                    for clips in (20, 50, 94):
                        drawn = np.random.default_rng(clips).choice(centred, (repeats, clips))
                        rates += [ours_share(drawn), plain_share(drawn)]
                    names = f"{each.rows[one].label} - {each.rows[two].label}"
                    found.append((f"{each.split} {key[0]}: {names}", rates))
    return found


def show(title: str, heads: tuple[str, ...], rows: list[tuple[int, list[float]]]) -> None:
    print(f"\n{title}\n  {'':>8}" + "".join(f"{head:>22}" for head in heads))
    for first, numbers in rows:
        print(f"  {first:>8}" + "".join(f"{number:>22.1f}" for number in numbers))


def draw(path: Path, covered: list, alarmed: list, told: list) -> None:
    """Three panels over the number of clips: coverage, false alarms, power."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    lines = (
        (covered, ("ours", "Student's t", "percentile bootstrap"), "intervals that hold the truth, %", 95),
        (
            [(n, [r[0], r[2], r[3], r[4], r[5]]) for n, r in alarmed],
            ("alike", "unlike", "unlike, plain flips", "one reckless", "reckless, plain flips"),
            "equal methods told apart, %",
            5,
        ),
        (
            told,
            tuple(f"{100 * (1 - e):.0f} % better" for e in EFFECTS),
            "better methods told apart, %",
            None,
        ),
    )
    for axis, (rows, names, title, goal) in zip(axes, lines, strict=True):
        for number, name in enumerate(names):
            style = "--" if "plain" in name or name in ("Student's t", "percentile bootstrap") else "-"
            axis.plot([n for n, _ in rows], [r[number] for _, r in rows], style, marker="o", label=name)
        if goal is not None:
            axis.axhspan(goal - 1, goal + 1, color="0.9")
            axis.axhline(goal, color="0.6", linewidth=1)
        axis.set(xlabel="source clips", title=title)
        axis.legend(fontsize=8)
        axis.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
    print(f"\nwrote {path}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=4000)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--rows", type=Path)
    given = parser.parse_args()
    if given.rows:
        heads = tuple(f"{n} clips, {how}" for n in (20, 50, 94) for how in ("ours", "plain"))
        print("equal methods told apart, %: " + "; ".join(heads))
        for name, rates in real(given.rows, given.repeats):
            print("  " + " ".join(f"{rate:6.1f}" for rate in rates) + f"  {name}")
        return
    covered, alarmed = coverage(given.repeats), alarms(given.repeats)
    told = power(given.repeats)
    show("95 % intervals that hold the truth, %, by clips", ("ours", "Student's t", "percentile"), covered)
    heads = tuple(f"{who}{how}" for who in ("alike", "unlike", "reckless") for how in ("", ", plain flips"))
    show("Equal methods told apart at level 5 %, %, by clips", heads, alarmed)
    names = tuple(f"{100 * (1 - effect):.0f} % better" for effect in EFFECTS)
    show("Better methods told apart, %, by clips", names, told)
    show(
        "Tables with anybody told from the best of equals, %, by methods", ("ours", "plain Holm"), tables()
    )
    if given.picture:
        draw(given.picture, covered, alarmed, told)


if __name__ == "__main__":
    main()
