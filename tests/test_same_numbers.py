"""Facts of two revisions are told apart: same, renamed, named, unnamed (``benchmarks/same_numbers.py``)."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import same_numbers

ROW = ("rows", "main", "cross")


@pytest.fixture
def page_patterns(tmp_path: Path) -> list[str]:
    page = tmp_path / "CHANGES.md"
    page.write_text(
        "# Numbers that moved\n\n"
        "- `rows / * / pan[parts=three] / *`: new batches.\n"
        "Prose about `rows / main / *` names nothing.\n"
        "- 2026-11-21: `rows` alone is no pattern either.\n"
    )
    return same_numbers.patterns(page)


def test_a_fact_that_moved_is_named_by_a_line_of_the_page_or_by_nothing(page_patterns: list[str]) -> None:
    before = {(*ROW, method, "mpjpe"): "1.0" for method in ("ik", "pan[parts=three]", "pant")}
    after = dict.fromkeys(before, "2.0")
    comparison = same_numbers.compare(before, after, {}, page_patterns)
    assert comparison.same == 0
    assert comparison.named == {
        "rows / * / pan[[]parts=three] / *": [
            ("rows / main / cross / pan[parts=three] / mpjpe", "1.0", "2.0")
        ]
    }
    assert [fact for fact, *_ in comparison.unnamed] == [
        "rows / main / cross / ik / mpjpe",
        "rows / main / cross / pant / mpjpe",
    ]
    report = comparison.text("main_job")
    assert "0 same, 0 renamed, 0 new, 1 named, 2 UNNAMED" in report
    assert "rows / main / cross / ik / mpjpe: '1.0' -> '2.0'" in report


def test_a_fact_may_be_called_otherwise_but_then_it_has_to_be_the_same() -> None:
    before = {(*ROW, "old_name", "a"): "1", (*ROW, "old_name", "b"): "2", (*ROW, "ik", "a"): "3"}
    after = {(*ROW, "name", "a"): "1", (*ROW, "name", "b"): "2.5", (*ROW, "ik", "a"): "3"}
    comparison = same_numbers.compare(before, after, {"old_name": "name"}, [])
    assert (comparison.same, comparison.renamed, comparison.new) == (1, 1, 0)
    assert comparison.unnamed == [("rows / main / cross / old_name / b", "2", "2.5")]


def test_a_fact_that_is_gone_differs_and_one_that_is_new_does_not() -> None:
    comparison = same_numbers.compare({(*ROW, "ik"): "1"}, {(*ROW, "pan"): "1"}, {}, [])
    assert (comparison.same, comparison.new) == (0, 1)
    assert comparison.unnamed == [("rows / main / cross / ik", "1", "(gone)")]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere", "HEAD", "--quick"], "'nowhere' is no revision of this repository"),
        (["HEAD", "HEAD", "--only", "nothing"], "there are no facts 'nothing' here, but main_job"),
        (["HEAD", "HEAD", "--only", "mixamo"], "there are no facts 'mixamo' here"),
        (["HEAD", "HEAD", "--data", "/no/such/folder"], "/no/such/folder is no folder"),
    ],
)
def test_wrong_words_compare_nothing_and_say_so(
    words: list[str], message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["same_numbers.py", *words])
    try:
        status = same_numbers.main()
    except SystemExit as stop:
        status = int(str(stop.code))
    assert status == 2
    assert message in capsys.readouterr().err
