"""A metric that does something wrong with one answer, and measures all others."""

import ctypes
import os
import sys
import time

import numpy as np

from retarget_bench.api import MetricCard, Value

VICTIM = "toy/small>tall/clip 0"


def write(comparison):
    for array in (comparison.predicted, comparison.expected, comparison.case.reference.rotations):
        array -= array.mean()


def setflags(comparison):
    for array in (comparison.predicted, comparison.expected, comparison.case.reference.rotations):
        array.setflags(write=True)
        array -= array.mean()


def fail(comparison):
    raise ValueError("no \ud800 sway")


def hang(comparison):
    while True:
        try:
            time.sleep(60)
        except Exception:
            continue


def hang_outside(comparison):
    ctypes.PyDLL(None).sleep(3600)  # no thread of Python goes on meanwhile


DEEDS = {
    "write": write,
    "setflags": setflags,
    "fail": fail,
    "quit": lambda comparison: sys.exit(3),
    "hang": hang,
    "nan": lambda comparison: {"sway": float("nan")},
    "inf": lambda comparison: {"sway": np.float32("-inf")},
    "text": lambda comparison: {"sway": "0.5"},
    "large": lambda comparison: {"sway": 1e301},
    "digits": lambda comparison: {"sway": 10**1000},
    "nothing": lambda comparison: {"sway": None},
    "list": lambda comparison: [0.5],
    "curve": lambda comparison: {"sway": {"a": 0.5}},
    "unnamed": lambda comparison: {"sway_by": {"": 0.5}},
    "undeclared": lambda comparison: {"sway": 0.5, "sway.secret": 1.0},
    "exit": lambda comparison: os._exit(5),
    "segfault": lambda comparison: ctypes.string_at(0),
    "hang_outside": hang_outside,
}


class Sway:
    """Parameters: ``does``, what it does wrong."""

    card = MetricCard(
        name="sway",
        summary="a toy",
        version="1",
        values=(
            Value("sway", "sway", "how far the hips sway", "m", "lower", "max - min", "here"),
            Value("sway_by", "by", "the same by axis", "m", "lower", "max - min", "here", index="axis"),
        ),
    )

    def __init__(self, does: str = "") -> None:
        self._deed = DEEDS.get(does)

    def compute(self, comparison):
        far = np.ptp(comparison.predicted[:, 0], axis=0).tolist()
        # copy_rotations goes farther
        if self._deed and comparison.case.info.id == VICTIM and far[2] < 0.4:
            return self._deed(comparison)
        return {"sway": far[0], "sway_by": {"x": far[0], "z": far[2]}}


plugin = Sway
