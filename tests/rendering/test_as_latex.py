"""Tables in LaTeX: a small reader of TeX judges them always, pdflatex where it is installed."""

import re
import shutil
import subprocess
from dataclasses import replace

import pytest
from small_tables import HOSTILE, make_table

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
    commands = re.findall(r"\\([a-zA-Z]+)", body.replace("\\\\", " "))
    assert set(commands) <= COMMANDS
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
    assert cells(source) == {5}


def beside(table):
    """The groups of a table as one, whose columns are of both splits."""
    cross, intra = table.groups
    columns = tuple(replace(c, split=group.split) for group in (cross, intra) for c in group.columns[:2])

    def rows(group_rows):
        return tuple(replace(row, cells=2 * row.cells[:2]) for row in group_rows)

    combined = replace(
        cross, split="", columns=columns, ranked=rows(cross.ranked), unranked=rows(cross.unranked)
    )
    return replace(table, groups=(combined,))


def test_splits_stand_beside_each_other():
    lines = latex([beside(make_table())]).splitlines()
    assert lines.count(r"\begin{table}") + lines.count(r"\end{table}") == 2
    assert r" & \multicolumn{2}{c}{cross} & \multicolumn{2}{c}{intra} &  \\" in lines
    assert r"\cmidrule(lr){2-3}\cmidrule(lr){4-5}" in lines
    assert r"{}broken (words) & -- & -- & -- & -- & 0/47 \\" in lines
    pair = r" & \textbf{3.32} & $1.03$"
    assert rf"{{}}ours{pair}{pair} & 47 \\" in lines
    other = next(line for line in lines if line.startswith("{}other"))
    assert r"{}\underline{$3.44$} \\ {}{\scriptsize $\pm$0.25}" in other
    assert "4.10" not in other
    assert lines.index(r"\midrule") < lines.index(other) < len(lines) - lines[::-1].index(r"\midrule")
    (caption,) = (line for line in lines if line.startswith(r"\caption"))
    assert caption.startswith(r"\caption{data words; cross: 47 cases. \textbf{Bold}: best; \underline")
    assert len(caption) < 260  # two lines of a page
    assert "% - note words" in lines
    assert "% words" in lines


def test_kinds_of_rows_have_headings_and_names_are_those_of_the_text():
    source = latex([make_table("copy_rotations[root_rule=none]")])
    judge(source)
    for heading in ("not ranked", "controls, not ranked"):
        assert rf"\multicolumn{{5}}{{@{{}}l}}{{\emph{{{heading}}}}} \\" in source
    assert (
        r"\raggedright copy\_\allowbreak{}rotations[\allowbreak{}root\_\allowbreak{}rule=none] & " in source
    )
    assert "\n{}old & " in source


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
    own_lines = [line for line in source.splitlines() if line.startswith("{}ours")]
    assert re.findall(r"(\d+)\.5", "".join(own_lines)) == [str(n) for n in range(23)]
    labels = re.findall(r"\\label\{(.*)\}", source)
    assert len(set(labels)) == 3
    assert labels[1] == f"{labels[0]}-2"


def test_intervals_come_on_request_and_take_room():
    wide = beside(make_table())
    (group,) = wide.groups
    rows = tuple(replace(row, cells=2 * row.cells) for row in group.ranked)
    wide = replace(wide, groups=(replace(group, columns=2 * group.columns, ranked=rows, unranked=()),))
    assert [latex([wide], intervals).count(r"\end{table") for intervals in (False, True)] == [1, 2]
    assert r"{}{\scriptsize -{}0.50 to 4.10}" in latex([make_table()], intervals=True)


def test_letters_that_standard_fonts_lack_are_told_by_code_point():
    assert plain("é 名 ø ÷") == "é [U+540D] [U+00F8] [U+00F7]"


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_pdflatex_reads_the_worst_names(tmp_path):
    tables = "\n".join(latex([make_table(name, name)]) + r"\clearpage" for name in HOSTILE)
    source = r"\documentclass{article}\usepackage{booktabs}\begin{document}" + tables + r"\end{document}"
    (tmp_path / "all.tex").write_text(source, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape", "all.tex"]
    completed = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, errors="replace")
    assert completed.returncode == 0, completed.stdout[-2000:]
    assert "Missing character" not in (tmp_path / "all.log").read_text(errors="replace")
