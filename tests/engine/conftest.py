"""Fixtures that several files of tests share."""

import pytest
from small_plans import know_toys
from submitted import runs, sound, unfilled  # noqa: F401


@pytest.fixture
def toys() -> None:
    """The toy plug-ins are known."""
    know_toys()
