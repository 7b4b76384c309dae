"""Tables in LaTeX: a small reader of TeX judges them always, pdflatex where it is installed."""

import re
import shutil
import subprocess

import pytest
from small_tables import HOSTILE, make_table

from retarget_bench.tables.rendering import latex
from retarget_bench.tables.rendering.as_latex import plain

COMMANDS = {
    "allowbreak", "begin", "bottomrule", "caption", "centering", "char", "circ", "downarrow", "emph", "end",
    "footnotesize", "ldots", "linewidth", "midrule", "multicolumn", "par", "parbox", "pm", "raggedright",
    "rightarrow", "scriptsize", "setlength", "small", "smallskip", "tabcolsep", "textasciicircum",
    "textasciitilde", "textbackslash", "textbar", "textbf", "textgreater", "textless", "textsuperscript",
    "times", "toprule", "uparrow",
}  # fmt: skip


def judge(source: str) -> None:
    """Raises AssertionError for unbalanced braces or environments, unknown commands and bare specials."""
    body = source.split("\n", 1)[1]  # the first line is a comment
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
    for which, name in re.findall(r"\\(begin|end)\{(\w+)\}", body):
        assert opened.append(name) is None if which == "begin" else opened.pop() == name
    assert not opened
    assert not re.search(r"\\\\\s*[\[*]", body)  # would be read as an option of the line break
    assert body.count("\n\n") == body.count("\\end{table}") - 1  # none within a table


def cells(source: str) -> set[int]:
    """How many cells the lines of the outer tables have."""
    flat = re.sub(r"\\begin\{tabular\}\[[tb]\].*?\\end\{tabular\}", "", source)
    lines = [line for line in flat.splitlines() if line.endswith(r"\\") and "multicolumn" not in line]
    return {len(re.sub(r"\\&", "", line).split("&")) for line in lines}


@pytest.mark.parametrize("name", HOSTILE)
def test_names_are_text_to_tex(name):
    source = latex([make_table(name, name)])
    judge(source)
    assert cells(source) == {5}


def test_the_judge_sees_what_is_wrong():
    good = latex([make_table()])
    for bad in (r"\input{x}", "{", "50% off", "a_b", "a \\\\ [2cm]", r"\end{tabular}", "$"):
        with pytest.raises((AssertionError, IndexError)):
            judge(good.replace("ours", bad, 1))


def test_the_table_is_drawn_as_ever():
    lines = latex([make_table()]).splitlines()
    assert r"\begin{tabular}{lrrrr}" in lines
    assert r"{}broken (words) & failed & failed & failed & 0/47 \\" in lines
    other = next(line for line in lines if line.startswith("{}other"))
    assert r"$3.44$\textsuperscript{=} \\ {}{\scriptsize -{}0.50 to 4.10}" in other
    assert r"\textbf{0.90} & n/a \textsuperscript{[1]} & 46/47 \\" in other
    assert {r"\toprule", r"\midrule", r"\bottomrule"} <= set(lines)
    assert lines.count(r"\end{table}") == 2


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
