"""Values of whole sets of results (FID and its kin): their features, draws, numbers and files.

For each case, ``files.collect`` has the set metrics make feature vectors, which wait in files of their own
until the unit is complete. Then ``evaluate`` draws the sets and computes one row for every value and target
structure of ``<method>.sets.csv``, beside the rows of cases.
"""

from retarget_bench.evaluation.set_metrics.values import SetValue, read, write

__all__ = ["SetValue", "read", "write"]
