"""FID where there is no right answer: what is seen of an answer, and by what its windows are drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from retarget_bench.api import Case
from retarget_bench.api.comparison import Comparison
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.metrics.fid import features as windows
from retarget_bench.metrics.fid_structure import FidStructure


@pytest.fixture(scope="module")
def case() -> Case:
    """A paired case that is long enough for windows."""
    data = Puppets()
    return data.load(data.cases("retarget", "intra")[0])


def test_an_answer_is_seen_alike_with_and_without_a_reference(case: Case) -> None:
    metric, answer = FidStructure(), case.reference
    with_one = metric.features(Comparison(case, answer))
    without = metric.features(Comparison(replace(case, reference=None), answer))
    assert len(without.generated) > 1
    np.testing.assert_array_equal(without.generated, with_one.generated)
    np.testing.assert_allclose(without.generated, with_one.real, atol=1e-5)
    assert without.real.shape == (0, with_one.real.shape[1])


def test_windows_are_drawn_by_the_speed_of_the_source(case: Case) -> None:
    """Whatever a method makes of the root: mean level speed of the source's hips, in heights."""
    answer = case.target.motion(case.reference.rotations, case.reference.root * 3.0, case.reference.fps)
    features = FidStructure().features(Comparison(replace(case, reference=None), answer))
    hips = case.source.positions[:, case.source.character.joint_of["hips"], ::2]
    hips = gaussian_filter1d(hips, 1.0, axis=0, mode="nearest", truncate=3.0)
    steps = np.linalg.norm(np.diff(hips, axis=0), axis=1) * 30.0 / case.source.character.height
    steps = np.concatenate([steps[:1], steps])
    speeds = [
        steps[at : at + windows.FRAMES].mean()
        for at in range(0, len(steps) - windows.FRAMES + 1, windows.HOP)
    ]
    np.testing.assert_allclose(features.speed, speeds, rtol=1e-5)
