"""Defaults of the command line, the only place where the core names plug-ins."""

DATASET = "puppets[size=tiny]"
METHOD = "ik"
PAPERS_DATASET = "mixamo"
"""The data set that published tables are about: their pairs are of its characters."""
TASK_METRICS = ("position", "smoothness")
"""Metrics that say something of every task, beside those that are made for it."""
VALIDATION = ("position", ("mpjpe_h.world", "mpjpe_h.root"))
"""The metric and its values that training is watched by; the first value decides which weights are kept."""
