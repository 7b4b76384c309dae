"""Checks of the benchmark and of plug-ins.

Imports evaluation, analysis and tables; the verdict imports motion alone.
Offers the regression gate, the probe of methods, the contract kit behind ``bench test``, and the verdict on
a retargeted motion.
"""
