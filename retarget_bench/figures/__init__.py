"""Charts of results: what they share (colours, order of methods, axis limits) and the drawing of files.

Imports tables and analysis.
Offers the palette, the method order, axis limits and charts by matplotlib (``plotting``).
"""
