"""Values of whole sets of results (FID and its kin): their features, draws, numbers and files.

For each case, ``files.collect`` has the set metrics make feature vectors, which wait in files of their own
until the unit is complete. Then ``evaluate`` draws the sets and writes one row for every value and target
structure to ``<method>.sets.csv`` beside the rows. The features go to ``<method>.features.npz``, from which
every number can be computed again. They are as disposable as predictions; the rows are what is kept.
"""

from retarget_bench.evaluation.set_metrics.values import SetValue, read, write

__all__ = ["SetValue", "read", "write"]
