"""Charts of results: data computed once (``data``), drawn as files (``plotting``) and in pages (``svg``).

Imports analysis, results, tables, motion and evaluation.
Offers the palette, method order, axis limits, and a function per kind of chart.
"""
