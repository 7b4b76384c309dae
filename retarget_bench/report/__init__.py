"""Results as one page that opens from disk: tables, charts, and the motion behind every number.

Imports figures, viewer, tables and analysis.
Offers the chapters of a page, the choice of cases, and the page.
"""
