"""Colours and axes of charts, and how cases are chosen."""

import math
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from retarget_bench.figures import axis_limits, palette
from retarget_bench.figures.data import values
from retarget_bench.figures.palette import COLOURS, CONTROLS, method_style
from retarget_bench.report import chapters, motions
from retarget_bench.results.result_matrix import ResultMatrix
from tests.engine.stored import header

LOWER = header("", [], "cross").values["mpjpe_h.world"]


def test_methods_differ_in_more_than_colour():
    styles = [
        method_style(k, quiet=quiet) for quiet in (False, True) for k in range(24 if not quiet else 8)
    ]
    assert len({(each.shape, each.dash) for each in styles}) == len(styles)


SEES = {
    "usual": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
"""What Machado, Oliveira and Fernandes (2009) publish for linear RGB at full severity."""
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def linear(colour: str) -> np.ndarray:
    value = np.array(to_rgb(colour))
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def lab(light: np.ndarray) -> np.ndarray:
    """CIE L*a*b* (D65) of linear RGB."""
    x = TO_XYZ @ np.clip(light, 0, 1) / TO_XYZ.sum(axis=1)
    f = np.where(x > 216 / 24389, np.cbrt(x), (x * 24389 / 27 + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def _luminance(colour: str) -> float:
    return float(TO_XYZ[1] @ linear(colour))


def _contrast(first, second):
    low, high = sorted([_luminance(first), _luminance(second)])
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("eyes", SEES)
def test_no_two_methods_look_alike(eyes):
    labs = [lab(np.array(SEES[eyes]) @ linear(colour)) for colour in palette.COLOURS]
    assert min(np.linalg.norm(a - b) for a, b in combinations(labs, 2)) > 20


def test_neighbours_differ_in_grey():
    grey = [lab(linear(colour))[0] for colour in palette.COLOURS]
    assert min(abs(a - b) for a, b in pairwise(grey)) >= 9


def test_colours_can_be_seen_on_white():
    assert min(_contrast("#ffffff", each) for each in (*COLOURS, *CONTROLS)) >= 3


def test_shades_darken():
    lights = [_luminance(rgb) for rgb in palette.shades()]
    assert len(lights) == palette.SHADES
    assert lights == sorted(lights, reverse=True)


# ------------------------------------------------------------------------------------------- numbers
def test_an_axis_leaves_out_only_what_is_far_worse():
    assert axis_limits.top([1.0, 2.0, 3.0]) == 3.0
    assert axis_limits.top([1.0, 2.0, 3.0, 400.0]) == axis_limits.ROOM * 2.5
    assert axis_limits.top([0.0, 1e-7, 0.2, 0.1, math.nan]) == 0.2
    assert axis_limits.top([]) > 0


def test_a_colour_scale_ends_before_one_method_that_is_far_off():
    numbers = {"a": [1.0, 2.0], "b": [1.0, 4.0], "far": [60.0, 90.0]}
    # the highest are 2, 4 and 90: 2.5 times the median is 10
    assert axis_limits.colour_end(numbers, 0.98) == 10.0
    assert axis_limits.colour_end({"a": [1.0, 2.0], "b": [1.0, 4.0]}, 1.0) == 4.0
    assert axis_limits.colour_end({}, 0.98) == 1.0


@pytest.mark.parametrize(
    ("better", "order"), [("lower", [2, 0, 3]), ("higher", [3, 0, 2]), ("target", [2, 3, 0])]
)
def test_the_worst_are_told_by_what_is_better(better, order):
    numbers = np.array([1.5, math.nan, 9.0, 0.5])
    matrix = ResultMatrix("data", "cross", (), np.array([]), (), {"v": replace(LOWER, better=better)})
    behind = values.worst(matrix, "v", numbers, "numbers")
    assert behind.worst == tuple((case, numbers[case]) for case in order)


# ------------------------------------------------------------------------------------------- choosing
def test_worst_median_and_best_are_chosen_first_and_all_in_the_end(results):
    report_chapters = chapters.chapters([results])
    split = report_chapters[0].splits[1]
    order = motions.order(split)
    assert sorted(order) == list(range(len(split.matrix.cases)))
    ranked = split.losses[split.ranked]
    places = np.argsort(np.argsort(ranked, kind="stable"), kind="stable").mean(axis=0)
    assert places[order[0]] == places.max()
    pairs = [split.matrix.cases[case].pair for case in order]
    assert len(set(pairs[:3])) == 3  # of three pairs with two clips each
    chosen = motions.chosen(report_chapters, 5)
    assert len(chosen) == len(set(chosen)) == 5
    assert chosen[:2] == [(0, 1, order[0]), (0, 0, motions.order(report_chapters[0].splits[0])[0])]
