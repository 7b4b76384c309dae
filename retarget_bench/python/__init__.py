"""The Python interface, ``import retarget_bench as rb``: runs, results, motions and lists of plug-ins.

Imports everything but the command line, whose commands call the same functions.
Offers plans and runs (``running``), ``Results``, tables and comparisons that notebooks show (``views``),
motions from files (``motions``) and lists (``listing``).
"""
