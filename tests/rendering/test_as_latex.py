"""Tables in LaTeX: a small reader of TeX judges them always, pdflatex where it is installed."""

import re
import shutil
import subprocess
from dataclasses import replace

import pytest
from small_tables import HOSTILE, make_table

from retarget_bench.tables.names import method_title
from retarget_bench.tables.rendering import latex
from retarget_bench.tables.rendering.as_latex import plain

COMMANDS = {
    "allowbreak", "begin", "bottomrule", "caption", "centering", "char", "circ", "cmidrule", "downarrow",
    "emph", "end", "label", "ldots", "linewidth", "midrule", "multicolumn", "pm", "raggedright",
    "rightarrow", "scriptsize", "setlength", "small", "tabcolsep", "textasciicircum", "textasciitilde",
    "textbackslash", "textbar", "textbf", "textgreater", "textless", "times", "toprule", "underline",
    "uparrow", "vspace",
}  # fmt: skip


def code(source: str) -> str:
    """The source without its comments."""
    return "\n".join(line for line in source.split("\n") if not line.startswith("%"))


def judge(source: str) -> None:
    """Raises AssertionError for unbalanced braces or environments, unknown commands, bare specials, and
    lines of another number of cells than the table has columns."""
    body = re.sub(r"\\label\{tab:[a-z0-9_.-]+\}\n", "", code(source))
    assert body.isascii() or all(each.isascii() or each.isalpha() for each in body)
    found = re.findall(r"\\([a-zA-Z]+)", body.replace("\\\\", " "))
    assert set(found) <= COMMANDS
    depth = 0
    for each in re.sub(r"\\[{}\\&%$#_]", "", body):
        depth += (each == "{") - (each == "}")
        assert depth >= 0
    assert depth == 0
    bare = re.sub(r"\\[{}\\&%$#_]", "", body)
    assert not re.search(r"[%#_^~]", re.sub(r"\$\^(\\circ|2)\$", "", bare))
    assert bare.count("$") % 2 == 0
    opened: list[str] = []
    for which, name in re.findall(r"\\(begin|end)\{(\w+\*?)\}", body):
        assert opened.append(name) is None if which == "begin" else opened.pop() == name
    assert not opened
    assert not re.search(r"\\\\\s*[\[*]", body)  # would be read as an option of the line break
    assert body.count("\n\n") == len(re.findall(r"\\end\{table\*?\}", body)) - 1  # none within a table
    for each in re.split(r"\\end\{table\*?\}", body)[:-1]:
        columns = re.search(r"\\begin\{tabular\}\{@\{\}(?:l|p\{.*?\})(r*)@\{\}\}", each)
        assert columns is not None
        assert cells(each) == {len(columns[1]) + 1}


def cells(source: str) -> set[int]:
    """How many cells the lines of the outer tables have."""
    flat = re.sub(r"\\begin\{tabular\}\[[tb]\].*?\\end\{tabular\}", "", code(source))
    lines = [line for line in flat.splitlines() if line.endswith(r"\\") and "multicolumn" not in line]
    return {len(re.sub(r"\\&", "", line).split("&")) for line in lines}


@pytest.mark.parametrize("name", HOSTILE)
def test_names_are_text_to_tex(name):
    source = latex([make_table(name, name)], intervals=True)
    judge(source)
    assert cells(source) == {9}


def test_the_judge_sees_what_is_wrong():
    good = latex([make_table()])
    for bad in (r"\input{x}", "{", "50% off", "a_b", "a \\\\ [2cm]", r"\end{tabular}", "$", "a & b"):
        with pytest.raises((AssertionError, IndexError)):
            judge(good.replace("ours", bad, 1))


def test_splits_stand_beside_each_other():
    lines = latex([make_table()]).splitlines()
    assert lines.count(r"\begin{table*}") == lines.count(r"\end{table*}") == 1
    assert r" & \multicolumn{4}{c}{cross} & \multicolumn{4}{c}{intra} \\" in lines
    assert r"\cmidrule(lr){2-5}\cmidrule(lr){6-9}" in lines
    assert r"{}broken (words) & -- & -- & -- & 0/47 & -- & -- & -- & -- \\" in lines
    ours = r" & \textbf{3.32} & $1.03$ & \textbf{0.989} & 47"
    assert rf"{{}}ours{ours}{ours} \\" in lines
    other = next(line for line in lines if line.startswith("{}other"))
    assert r"{}\underline{$3.44$} \\ {}{\scriptsize $\pm$0.25}" in other
    assert "4.10" not in other
    assert lines.index(r"\midrule") < lines.index(other) < len(lines) - lines[::-1].index(r"\midrule")
    (caption,) = (line for line in lines if line.startswith(r"\caption"))
    assert caption.startswith(
        r"\caption{data words; cases: 47 cross, 47 intra. \textbf{Bold}: best; \underline"
    )
    assert len(caption) < 260  # two lines of a page
    assert "% note words" in lines


def test_wide_groups_and_breakdowns_have_tables_of_their_own():
    table = make_table()
    wide = [replace(each, columns=3 * each.columns, ranked=(), unranked=()) for each in table.groups]
    parts = [replace(each, subject="mpjpe_h.world") for each in table.groups]
    for groups in (wide, parts):
        assert len(re.findall(r"\\begin\{table\*?\}", latex([replace(table, groups=tuple(groups))]))) == 2


def test_more_columns_than_fit_a_page_stand_below_each_other():
    table = make_table()
    (first, *_) = table.groups
    rows = tuple(
        replace(row, cells=tuple(replace(row.cells[0], text=f"{n}.5", mark="") for n in range(23)))
        for row in first.ranked
    )
    names = [f"value {n}" for n in range(23)]
    columns = tuple(replace(first.columns[0], label=name) for name in names)
    source = latex([replace(table, groups=(replace(first, columns=columns, ranked=rows, unranked=()),))])
    judge(source)
    assert [len(each) for each in re.findall(r"\\begin\{tabular\}\{@\{\}l(r*)", source)] == [
        11,
        11,
        4,
    ]  # with n
    ours = [line for line in source.splitlines() if line.startswith("{}ours")]
    assert re.findall(r"(\d+)\.5", "".join(ours)) == [str(n) for n in range(23)]
    labels = re.findall(r"\\label\{(.*)\}", source)
    assert len(set(labels)) == 3
    assert labels[1] == f"{labels[0]}-2"


def test_a_row_that_is_ranked_in_one_split_only_is_set_apart_in_the_other():
    table = make_table()
    cross, intra = table.groups
    apart = replace(intra, ranked=intra.ranked[:1], unranked=(replace(intra.ranked[1], mark="few"),))
    source = latex([replace(table, groups=(cross, apart))])
    judge(source)
    other = next(line for line in source.splitlines() if line.startswith("{}other"))
    assert r"\emph{\textbf{0.90}}" in other
    assert r"\emph{italic}: not ranked in this split" in source
    assert "italic" not in latex([table])


def test_controls_below_the_line_are_named_once():
    table = make_table()
    cross, intra = (replace(each, unranked=each.unranked[1:]) for each in table.groups)
    source = latex([replace(table, groups=(cross, intra))])
    assert "below the line: controls, not ranked" in source
    assert "\n{}old & " in source


def test_intervals_come_on_request_and_take_room():
    table = make_table()
    groups = tuple(
        replace(
            each,
            columns=each.columns + each.columns[:2],
            ranked=tuple(replace(row, cells=row.cells + row.cells[:2]) for row in each.ranked),
            unranked=(),
        )
        for each in table.groups
    )
    made = [
        latex([replace(table, groups=groups)], intervals).count(r"\end{table*}") for intervals in (0, 1)
    ]
    assert made == [1, 2]
    assert r"{}{\scriptsize -{}0.50 to 4.10}" in latex([make_table()], intervals=True)


@pytest.mark.parametrize(
    ("label", "title"),
    [
        ("humot", "HuMoT"),
        ("pan", "PAN"),
        ("nkn", "NKN"),
        ("smrm", "SMRM"),
        ("r2et", "R2ET"),
        ("ik[hands=false]+footfix", "IK + footfix (hands false)"),
        ("copy_rotations[root_rule=none]", "copy rotations (root rule none)"),
        ("other_clip", "shuffled reference"),
        ("not_installed", "not_installed"),
        ("a [b", "a [b"),
    ],
)
def test_methods_are_named_as_people_write_them(label, title):
    assert method_title(label) == title
    drawn = latex([make_table(label)]).replace(r"\allowbreak{}", "").replace(r"\raggedright ", "{}")
    assert f"\n{{}}{plain(title)} & " in drawn


def test_letters_that_standard_fonts_lack_are_told_by_code_point():
    assert plain("é 名 ø ÷") == "é [U+540D] [U+00F8] [U+00F7]"


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_pdflatex_reads_the_worst_names(tmp_path):
    tables = "\n".join(latex([make_table(name, name)]) + r"\clearpage" for name in HOSTILE)
    source = r"\documentclass{article}\usepackage{booktabs}\begin{document}" + tables + r"\end{document}"
    (tmp_path / "all.tex").write_text(source, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape", "all.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, errors="replace")
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Missing character" not in (tmp_path / "all.log").read_text(errors="replace")
