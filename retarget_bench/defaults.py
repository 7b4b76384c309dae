"""Defaults of commands and of Python, the only place where the core names plug-ins."""

import os

DATASET = "puppets[size=tiny]"
METHOD = "ik"
COPYING = "copy_rotations"
"""What printed numbers are to be read beside."""
TASK = "retarget"
SCAN_METHOD = "correspondence_free"
"""Of scanned motion, whose source has no skeleton."""
WEIGHTS = "puppets"
"""The name of the weights that learned methods ship, after the data set that they were trained on."""
PAPERS_DATASET = "mixamo"
"""The data set that published tables are about: their pairs are of its characters."""
TASK_METRICS = ("position", "smoothness")
"""Metrics that say something of every task, beside those that are made for it."""
VALIDATION = ("position", ("mpjpe_h.world", "mpjpe_h.root"))
"""The metric and its values that training is watched by; the first value decides which weights are kept."""
OUT = "runs"
"""The folder of results."""
MOST_JOBS = 8
"""Most processes that are started by default, since each one takes memory."""


def jobs() -> int:
    """Number of processes: one per core that this one may use, often fewer than exist in a container."""
    if hasattr(os, "sched_getaffinity"):
        return min(len(os.sched_getaffinity(0)), MOST_JOBS)
    return min(os.cpu_count() or 1, MOST_JOBS)
