"""Fixtures that several files of tests share."""

from submitted import made, runs, sound  # noqa: F401
