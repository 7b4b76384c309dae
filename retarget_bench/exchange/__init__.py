"""Files that leave the benchmark or come into it.

Imports evaluation, analysis and tables.
Offers the export of data sets and of cases, and submissions with their leaderboard.
"""
