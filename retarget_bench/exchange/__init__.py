"""Export of cases and data sets, and submissions.

Imports everything but the viewer and the report.
Offers the export of data sets and of cases, and submissions with their leaderboard.
"""
