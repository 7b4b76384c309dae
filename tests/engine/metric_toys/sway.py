"""A metric that does something wrong with one case, and measures the others."""

import ctypes
import os
import sys
import time

import numpy as np

from retarget_bench.api import MetricCard, Value

VICTIM = "toy/small>tall/clip 0"


def write(comparison):
    comparison.predicted[:] -= comparison.predicted.mean()


def setflags(comparison):
    for array in (comparison.predicted, comparison.case.reference.positions):
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
    ctypes.PyDLL(None).sleep(3600)  # with the interpreter's lock


DEEDS = {
    "write": write,
    "setflags": setflags,
    "raise": fail,
    "hang": hang,
    "quit": lambda comparison: sys.exit(3),
    "nan": lambda comparison: {"sway": float("nan")},
    "inf": lambda comparison: {"sway": np.float32("-inf")},
    "text": lambda comparison: {"sway": "0.5"},
    "large": lambda comparison: {"sway": 1e301},
    "huge": lambda comparison: {"sway": 10**1000},
    "nothing": lambda comparison: {"sway": None},
    "list": lambda comparison: [0.5],
    "curve": lambda comparison: {"sway": {"a": 0.5}},
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
        values=(Value("sway", "sway", "how far the hips sway", "m", "lower", "max - min", "here"),),
    )

    def __init__(self, does: str = "") -> None:
        self._deed = DEEDS.get(does)

    def compute(self, comparison):
        if self._deed is not None and comparison.case.info.id == VICTIM:
            return self._deed(comparison)
        return {"sway": float(np.ptp(comparison.predicted[:, 0, 0]))}


plugin = Sway
