"""Checks of the benchmark and of plug-ins.

Imports evaluation, analysis and tables.
Offers the regression gate, the probe of methods, and the contract kit behind ``bench test``.
"""
