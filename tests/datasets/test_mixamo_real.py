"""Mixamo's real clips, where they are at hand: what loads, and the published copy-rotations figures."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.api import SPLITS, Context
from retarget_bench.datasets.mixamo import Mixamo
from retarget_bench.methods.copy_rotations import CopyRotations

A = ("Aj", "BigVegas", "Kaya")
B = ("Goblin_m", "Mousey_m")
GROUPS = {
    "within A": {(s, t) for s in A for t in A if s != t},
    "within B": {(s, t) for s in B for t in B if s != t},
    "A to B": {(s, t) for s in A for t in B},
    "B to A": {(s, t) for s in B for t in A},
    "BigVegas to B": {("BigVegas", t) for t in B},
}
FIGURES = {
    "within A": (0.0294, 0.0083, 0.506),
    "within B": (0.0439, 0.0075, 1.545),
    "A to B": (0.0436, 0.0070, 1.086),
    "B to A": (0.0699, 0.0121, 3.285),
    "BigVegas to B": (0.0394, 0.0065, 0.816),
}
"""Mean over pairs of the mean over clips: world and root-relative error in heights, squared error x 1000 by
the SAN code's rule. Whole clips at 60 fps, 22 body joints, H1, root scaled by the ratio of root offsets;
computed for the project's notes by separate code."""


@pytest.fixture(scope="module")
def root(real_data: Path) -> str:
    folder = real_data / "mixamo_san"
    if not folder.is_dir():
        pytest.skip(f"no Mixamo clips: {folder} is not there")
    return str(folder)


def errors(case, prediction):
    """World, root-relative and squared error of one case, written out."""
    difference = (prediction.positions - case.reference.positions) / case.target.measures.h1
    centred = difference - difference[:, :1]
    return (
        np.sqrt((difference**2).sum(axis=-1)).mean(),
        np.sqrt((centred**2).sum(axis=-1)).mean(),
        1000.0 * (difference**2).mean(),
    )


@pytest.fixture(scope="module")
def by_pair(root):
    dataset = Mixamo(root, structure="body22", fps=60.0)
    method = CopyRotations(root_rule="root_offset")
    pairs = defaultdict(list)
    for split in ("intra", "cross"):
        for info in dataset.cases("retarget", split):
            case = dataset.load(info)
            assert len(case.target.skeleton) == 22
            prediction = method.retarget(case.source, case.target, context=Context())
            pairs[info.source, info.target].append(errors(case, prediction))
    return {pair: np.mean(rows, axis=0) for pair, rows in pairs.items()}


@pytest.mark.parametrize("group", GROUPS)
def test_copy_rotations_reproduces_the_published_figures(by_pair, group):
    got = np.mean([by_pair[pair] for pair in sorted(GROUPS[group])], axis=0)
    for value, printed, digits in zip(got, FIGURES[group], (4, 4, 3), strict=True):
        assert round(value, digits) == printed


def test_all_of_the_folder_is_listed(root):
    dataset = Mixamo(root)
    sizes = {split: len(dataset.cases("retarget", split)) for split in SPLITS}
    assert sizes == {"self": 5 * 53, "intra": 8 * 53 - 6, "cross": 12 * 53 - 8}
    assert [note for note in dataset.notes if "14 ordered pairs in 1 clip" in note] == list(dataset.notes)
    assert "Aj 72, BigVegas 109, Goblin_m 109, Kaya 157, Mousey_m 109 frames" in dataset.notes[0]
    assert {name: len(body.skeleton) for name, body in dataset.characters().items()} == {
        **dict.fromkeys(A, 23),
        **dict.fromkeys(B, 28),
    }
