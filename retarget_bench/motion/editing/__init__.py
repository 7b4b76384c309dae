"""Edits of a retargeting that no method makes: a motion's start, its path and ends, and parts of a body
that a source lacks.

They are of ``bench retarget`` and ``rb.retarget``. Methods in runs are scored without them, and no other
module of ``motion/`` imports them, so they are no part of result keys. ``edited`` puts them together.
"""
