"""Colours can be told apart: by anybody, on white, and on a grey printer."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from retarget_bench.figures import palette
from retarget_bench.results.header import MethodInfo

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


@pytest.mark.parametrize("eyes", SEES)
def test_no_two_methods_look_alike(eyes):
    seen = [lab(np.array(SEES[eyes]) @ linear(colour)) for colour in palette.COLOURS]
    assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > 20


def test_neighbours_differ_in_grey():
    grey = [lab(linear(colour))[0] for colour in palette.COLOURS]
    assert min(abs(a - b) for a, b in pairwise(grey)) >= 9


@pytest.mark.parametrize("colour", [*palette.COLOURS, *palette.CONTROLS, palette.SOURCE, palette.REFERENCE])
def test_thin_lines_stand_out_on_white(colour):
    assert 1.05 / (TO_XYZ[1] @ linear(colour) + 0.05) >= 3.0


def test_colours_start_again():
    last = len(palette.COLOURS)
    methods = [palette.method_style(place).colour for place in (0, last - 1, last)]
    assert methods[2] == methods[0] != methods[1]
    control = MethodInfo(label="still", privileged=(), control=True)
    controls = [palette.method_style(place, control).colour for place in (0, 3)]
    assert controls[0] == controls[1]


def test_no_two_methods_share_colour_and_mark():
    styles = [palette.method_style(place) for place in range(len(palette.COLOURS) * palette.SHAPES)]
    assert len({(style.colour, style.shape) for style in styles}) == len(styles)
