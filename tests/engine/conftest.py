"""Fixtures that several files of tests share."""

from submitted import runs, sound, unfilled  # noqa: F401
