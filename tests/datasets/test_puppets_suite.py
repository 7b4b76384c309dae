"""Whether the quality suite of the puppets is part of this run, and which files it has."""

from __future__ import annotations

import warnings

import pytest

from tests.datasets import puppets_suite


def test_the_suite_is_run_where_anything_that_it_measures_has_changed(
    request: pytest.FixtureRequest,
) -> None:
    if puppets_suite.left_out(request.config.option.markexpr):
        pytest.skip(
            f"the quality suite of the puppets ({len(puppets_suite.FILES)} files) is left out: neither the "
            f"generator nor the suite has changed since it passed; it runs with -m 'slow or not slow'"
        )
    if request.config.option.markexpr == "not slow":
        warnings.warn(
            "the quality suite of the puppets is part of this run, a minute of it, as what it measures has "
            "changed since it passed; python -m tests.datasets.puppets_suite runs it and notes that it did",
            stacklevel=1,
        )


def test_the_suite_is_left_out_only_as_it_passed(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppets_suite, "PASSED", tmp_path / "passed.txt")
    assert not puppets_suite.left_out("not slow")
    puppets_suite.PASSED.write_text("01234567\n")
    assert not puppets_suite.left_out("not slow")
    puppets_suite.PASSED.write_text(puppets_suite.state() + "\n")
    assert puppets_suite.left_out("not slow")
    assert not puppets_suite.left_out("slow or not slow")
    assert all((puppets_suite.HERE / name).is_file() for name in puppets_suite.FILES)
