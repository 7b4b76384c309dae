"""Analysis of results: means with intervals, paired tests, ties, and breakdowns.

Imports results, and evaluation for the names of tasks and sets; draws and prints nothing.
Offers statistics, summaries, breakdowns, pairwise comparisons, groups of ties and protocol factors.
"""
