"""Charts of results: data computed once (``data``), drawn in files and on pages (``plotting``).

Imports analysis, results, tables, motion and evaluation.
Offers the palette, method order, axis limits, and a function per kind of chart.
"""
