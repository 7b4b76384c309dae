"""Whether ranks on one data set are ranks on another: Spearman's correlation over methods, by column.

    bench run METHODS -s cross -o runs/puppets
    bench run METHODS -s cross -o runs/mixamo -d mixamo --root DIR
    python benchmarks/rank_correlations.py runs/puppets runs/mixamo

Each folder holds one data set; the last one is what the others are compared with. Only methods that are
ranked and have numbers on all count. Prints a table in Markdown, with 95 % intervals over methods
(bootstrap).
"""

import argparse

import numpy as np
import pandas as pd
from scipy.stats import spearmanr

import retarget_bench as rb

COLUMNS = {
    "mpjpe_h.world": "MPJPE",
    "mpjpe_h.path_fitted": "MPJPE, path fitted",
    "mpjpe_h.root": "MPJPE, root-aligned",
    "contact_recall": "contact recall",
    "contact_precision": "contact precision",
    "fid": "FID",
    "foot_slide": "foot skating",
    "jerk_ratio": "jerk ratio",
}
GOALS = {"jerk_ratio": 1.0}
"""Values that are best at a number, and are ranked by how far they are from it, as a ratio."""
DIGITS = 6
LEAST = 5
"""Methods with numbers on both, below which nothing is said."""
DRAWS = 9999


def ranked(folder: str) -> tuple[str, pd.DataFrame]:
    """The name of a folder's data set, and methods by columns."""
    frame = rb.load_results(folder).table(list(COLUMNS), splits=("cross",)).frame
    frame = frame[frame.ranked]
    table = frame.pivot(index="method", columns="value_id", values="value")
    return frame.dataset.iloc[0], table.reindex(columns=list(COLUMNS))


def compared(one: pd.Series, other: pd.Series, goal: float | None) -> str:
    """Spearman's correlation with its interval; methods without a number on either are left out."""
    both = pd.concat([one, other], axis=1, keys=("one", "other")).dropna().to_numpy()
    if len(both) < LEAST:
        return f"of {len(both)} methods"
    if goal is not None:
        both = np.abs(np.log(both / goal))
    both = both.round(DIGITS)
    picks = np.random.default_rng(0).integers(len(both), size=(DRAWS, len(both)))
    drawn = [spearmanr(both[pick]).statistic for pick in picks if np.ptp(both[pick], axis=0).all()]
    low, high = np.quantile(drawn, (0.025, 0.975))
    return f"{spearmanr(both).statistic:.2f} [{low:.2f}, {high:.2f}]"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="FOLDER", help="of results, two or more")
    folders = parser.parse_args().folders
    if len(folders) < 2:
        parser.error(
            "name two folders of results or more; the last one is what the others are compared with"
        )
    try:
        tables = [ranked(folder) for folder in folders]
    except rb.BenchError as error:
        raise SystemExit(f"rank_correlations.py: {error}") from None
    *others, (last, known) = tables
    shared = known.index
    for _, table in others:
        shared = shared.intersection(table.index)
    print(f"{len(shared)} methods, against {last}: {', '.join(sorted(shared))}\n")
    print("| column |", *(f"{name} |" for name, _ in others))
    print("|---|", *("---:|" for _ in others))
    for column, label in COLUMNS.items():
        cells = [
            compared(table.loc[shared, column], known.loc[shared, column], GOALS.get(column))
            for _, table in others
        ]
        print(f"| {label} |", *(f"{cell} |" for cell in cells))


if __name__ == "__main__":
    main()
