"""Export of cases and data sets, and submissions.

Imports evaluation, analysis and tables.
Offers the export of data sets and of cases, and submissions: their card, their checks and the leaderboard.
"""
