"""The regression gate behind ``bench check``: whether everything still measures the same.

``run.py`` measures facts (``frozen.py``: metrics on frozen motions; ``core.py``: the core on frozen inputs)
and rows of methods (``method_rows.py``), which ``golden.py`` keeps as files. ``compare.py`` puts golden
ones and those of now side by side, and ``report.py`` says what moved.
"""
