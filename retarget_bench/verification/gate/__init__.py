"""The regression gate behind ``bench check``: does anything that is measured still measure the same?

``run.py`` measures (``frozen.py``: metrics on frozen motions; ``core.py``: parts of the core on frozen
inputs; ``method_rows.py``: methods on a few cases) into a ``Snapshot``, ``golden.py`` keeps such a snapshot
as files, ``compare.py`` puts two side by side, and ``report.py`` says what moved.
"""
