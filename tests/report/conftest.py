"""Results with odd names, and a report of them, made once."""

from __future__ import annotations

import pytest

from tests.report import odd_runs


@pytest.fixture(scope="session")
def results(tmp_path_factory):
    """The folder of results, whose predictions are there."""
    root = tmp_path_factory.mktemp("runs with spaces")
    odd_runs.ran(root)
    return root


@pytest.fixture(scope="session")
def report_file(results, tmp_path_factory):
    """The report of them, as a file."""
    file = tmp_path_factory.mktemp("a report") / "a report.html"
    odd_runs.report(results, "-o", file, "--clips", 4)
    return file
