"""What results say: means with intervals, paired tests, ties, and parts of a split.

Imports results, and evaluation for the names of tasks and sets; draws and prints nothing.
Offers statistics, summaries, breakdowns, pairwise comparisons, groups of ties and protocol factors.
"""
