"""Fixtures that several files of tests share."""

from collections.abc import Iterator

import pytest
from small_plans import know_toys
from submitted import runs, sound, unfilled  # noqa: F401

from retarget_bench.plugins import registry


@pytest.fixture
def toys() -> None:
    """The toy plug-ins are known."""
    know_toys()


@pytest.fixture(scope="module", autouse=True)
def plugins_of_files() -> Iterator[None]:
    """Plug-ins of files that a module of tests adds are known to no other."""
    before = dict(registry._FILES)
    yield
    registry._FILES.clear()
    registry._FILES.update(before)
