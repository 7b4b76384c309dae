"""A small table that has one of everything, and the names that break renderers."""

from __future__ import annotations

from dataclasses import replace

from retarget_bench.analysis.statistics import Interval
from retarget_bench.analysis.summary import Ranking
from retarget_bench.tables.model import (
    FAILED,
    NOT_APPLICABLE,
    NOT_RUN,
    OTHER_VERSION,
    Cell,
    Column,
    Group,
    Problem,
    Provenance,
    Row,
    Table,
)

HOSTILE = [
    "a|b<script>alert(1)</script>",
    "\"><img src=x onerror=alert(1)>' onload='x",
    "\\ & % $ # _ { } ~ ^ < > | \" ' `",
    "\\end{tabular}\\input{/etc/passwd}",
    "[2cm] name",
    "* name",
    "&amp; &lt; {{ 7*7 }} {% raw %}",
    "line\nbreak\r\nand\ttab",
    "\x1b[2J\x1b[31mred\x07\x00",
    "right\u202eto left\u200b",
    "名前 é ñ Ω 🙂 a\u0301",
    "=1+1,;\"quoted\"",
    "[link](http://x) **bold** `code` ~~gone~~",
    "---|---",
    "</style></title></table><!--",
    "",
]  # fmt: skip

COLUMNS = (
    Column(
        "mpjpe_h.world", "error, world", "% of height", "lower", "how far joints are",
        formula="|p - g| / h", version="position 1",
    ),
    Column("jerk_ratio", "jerk ratio", "1", "target", "jerk over the reference's"),
    Column("recall", "recall", "1", "higher", "share of contacts kept"),
)  # fmt: skip


def make_table(label: str = "ours", words: str = "words") -> Table:
    """Two ranked rows and two others; ``label`` and ``words`` stand wherever people's text can."""
    world = Cell("3.32", 3.321, Interval(2.91, 3.80), "best", 2, 47, 43)
    worse = Cell("3.44", 3.444, Interval(-0.5, 4.1), "tied", 2, 45, 42, spread=0.25)
    ratio = Cell("1.03", 1.03, None, "", 2, 47, 43, place=1)
    away = Cell("0.90", 0.90, None, "best", 2, 47, 43, place=0)
    recall = Cell("0.989", 0.989, Interval(0.97, 1.0), "best", 3, 47, 43)
    ranked = (
        Row(label, "", (world, ratio, recall), "47", words),
        Row("other", "", (worse, away, Cell(NOT_APPLICABLE, reason=words, footnote=1)), "46/47", words),
    )
    unranked = (
        Row("broken", words, (Cell(FAILED),) * 3, "0/47"),
        Row(
            "old",
            "control",
            (Cell(OTHER_VERSION, reason="old", footnote=2), Cell(NOT_RUN), Cell("0.5", 0.5)),
            "47",
        ),
    )
    common = (Ranking((), {}, 47, 43), Ranking((), {}, 46, 42), None)
    cross = Group("cross: 47 cases", "cross", COLUMNS, ranked, unranked, common, below=(words,))
    return Table(
        title=f"data {words}",
        groups=(cross, replace(cross, title="intra: 2 cases", split="intra", unranked=())),
        notes=(f"note {words}",),
        footnotes=(f"reason {words}", "older"),
        problems=(Problem("cross", label, "failed", words, (f"data/{words}", "data/b")),),
        provenance=(
            Provenance(
                label, words, ("cross",), "1", "abcd", (0,), "2026-01-01", "beef", "numpy 2",
                f"bench run {words}",
            ),
        ),
        data=(("data set", words),),
        splits={"cross": f"another body {words}", "intra": f"a like body {words}"},
    )  # fmt: skip
