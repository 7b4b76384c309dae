"""Tables for terminals."""

from dataclasses import replace

import pytest
from small_tables import HOSTILE, make_table

from retarget_bench.tables.model import Column
from retarget_bench.tables.rendering import text, words
from retarget_bench.tables.rendering.as_text import WIDTH

GOLDEN = """\
data words
cross: 47 cases
                            error,
                           world ↓
                              % of      jerk
  method                    height  ratio →1  recall ↑      n
  ours                       3.32*     1.03     0.989*     47
  other                      3.44=     0.90*   n/a [1]  46/47
                            ±0.25
  (common cases)               47        46
  -- not ranked:
  broken (words)           failed    failed    failed    0/47
  -- controls, not ranked:
  old             other version [2]  not run      0.5      47
  words
"""


def shown(label="ours", note="words", **options) -> str:
    return text([make_table(label, note)], **options)


def test_the_table_is_drawn_as_ever():
    drawn = shown().split("\n\nintra")[0]
    assert [line.split() for line in drawn.splitlines()] == [line.split() for line in GOLDEN.splitlines()]
    lines = drawn.splitlines()
    ends = {
        line.index(number) + len(number)
        for line, number in zip(lines[6:8], ("3.32*", "3.44="), strict=True)
    }
    assert len(ends) == 1  # numbers stand below each other


def test_intervals_are_shown_on_request_and_explained():
    assert "2.91–3.80" not in shown()
    assert "2.91–3.80" in shown(intervals=True)
    assert "-0.50 to 4.10" in shown(intervals=True)
    assert "They hold for these characters" in " ".join(shown(intervals=True).split())


@pytest.mark.parametrize("intervals", [False, True])
@pytest.mark.parametrize("name", HOSTILE)
def test_no_name_moves_the_cursor_hides_text_or_breaks_the_columns(name, intervals):
    drawn = shown(name, name, intervals=intervals)
    assert all(line.isprintable() for line in drawn.split("\n"))
    assert max(map(words.width, drawn.splitlines())) <= WIDTH
    numbers = [line for line in drawn.splitlines() if "3.32*" in line]
    assert len(numbers) == 2
    assert all(line.endswith(" 47") for line in numbers)


def test_many_columns_are_turned_and_all_numbers_are_there():
    (group, _) = make_table().groups
    columns = tuple(replace(group.columns[0], id=f"value.{n}") for n in range(12))
    rows = tuple(
        replace(row, label=f"a method with a rather long name[parameter={n}]", cells=(row.cells[0],) * 12)
        for n, row in enumerate(group.ranked * 4)
    )
    wide = replace(group, columns=columns, ranked=rows, unranked=(), common=(None,) * 12)
    drawn = text([replace(make_table(), groups=(wide,))])
    assert max(map(words.width, drawn.splitlines())) <= WIDTH
    assert drawn.count("3.32*") == drawn.count("3.44=") == 4 * 12
    assert "value.11 ↓ [% of height]" in drawn


def test_long_headings_and_units_are_broken():
    group = make_table().groups[0]
    odd = Column("x", "averylongwordwithoutanyspaceinit" * 3, "unit" * 40, "lower", "m" * 300)
    drawn = text([replace(make_table(), groups=(replace(group, columns=(odd,) * 3),))])
    assert max(map(words.width, drawn.splitlines())) <= WIDTH


@pytest.mark.parametrize(
    ("name", "most", "lines"),
    [
        ("short", 10, ["short"]),
        ("copy[rule=none]", 12, ["copy[", "  rule=none]"]),
        ("two words", 5, ["two", "  wor", "  ds"]),
        ("名前名前", 4, ["名前", "  名", "  前"]),
        ("", 10, [""]),
    ],
)
def test_names_are_broken_where_they_can_be(name, most, lines):
    assert words.wrapped(name, most) == lines


@pytest.mark.parametrize("most", [40, 60, 80])
def test_lines_break_neither_options_nor_commands(most):
    hint = (
        "four-legged bodies have a table of their own: bench table --bodies four-legged; see --no-controls"
    )
    lines = words.filled(hint, most, "- ", "  ")
    assert max(map(len, lines)) <= most
    assert any("bench table --bodies four-legged" in line for line in lines)
    assert " ".join(lines).split()[1:] == hint.split()


def test_untrained_and_learned_methods_stand_in_two_groups_where_there_are_both():
    table = make_table()
    group = table.groups[0]
    both = replace(group, ranked=(group.ranked[0], replace(group.ranked[1], learned=True)))
    lines = text([replace(table, groups=(both,))]).splitlines()
    heads = [line.strip() for line in lines if line.startswith("  --")]
    assert heads == ["-- untrained:", "-- learned:", "-- not ranked:", "-- controls, not ranked:"]
    assert lines.index("  -- learned:") == next(n for n, line in enumerate(lines) if "3.44=" in line) - 1


def test_all_but_findings_marks_and_problems_waits_for_notes():
    table = replace(make_table(), finding="ours is best.")
    brief, full = (" ".join(text([table], notes=notes).split()) for notes in (False, True))
    assert "ours is best. * best, or equal to it; = no significant difference" in brief
    assert "ours failed on some cases (cross 2): words" in brief
    for phrase in ("note words", "how far joints are", "Numbers are means over source clips", words.TIED):
        assert " ".join(phrase.split()) not in brief
        assert " ".join(phrase.split()) in full
