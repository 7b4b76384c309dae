"""Results as one page that opens from disk: tables, charts, and the motion behind every number.

Imports tables, figures and viewer.
Offers the chapters of a report and the page that they make.
"""
