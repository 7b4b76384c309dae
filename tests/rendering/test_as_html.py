"""The page of results: whole, safe, sortable, and clear to somebody who never saw the project."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from small_tables import COLUMNS, HOSTILE, make_table

from retarget_bench.errors import printable
from retarget_bench.tables.model import EMPTY, Cell
from retarget_bench.tables.rendering import RENDERERS, html, words
from retarget_bench.tables.rendering import text as plain_text
from retarget_bench.tables.rendering.as_html import sort_key

VOID = {"meta", "br", "img", "input", "link", "hr"}


class Page(HTMLParser):
    """Tags with the names of their attributes, the values of those, and the text outside scripts."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, ...]] = []
        self.values: list[tuple[str, str]] = []
        self.texts: list[str] = []
        self.open: list[str] = []
        self.feed(source)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, *(name for name, _ in attributes)))
        self.values += [(name, value or "") for name, value in attributes]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())


@pytest.mark.parametrize("name", HOSTILE)
def test_names_are_text_and_nothing_else(name):
    page = Page(html([make_table(name, name)]))
    harmless = Page(html([make_table("harmless", name and "harmless")]))
    assert page.tags == harmless.tags  # no tag and no attribute more
    assert printable(name) in " ".join(page.texts) or printable(name) in page.text
    assert not re.search(r"[\x00-\x08\x0b-\x1f\u202a-\u202e]", html([make_table(name, name)]))


def test_the_page_asks_nobody_for_anything():
    source = html([make_table()])
    page = Page(source)
    assert {value[0] for name, value in page.values if name in ("href", "src")} == {"#"}
    assert not re.search(r"https?:|//[a-z]|@import|url\(", source)
    assert "default-src 'none'" in source
    anchors = {value for name, value in page.values if name == "id"}
    assert {value[1:] for name, value in page.values if name == "href"} <= anchors
    assert len(anchors) == sum(name == "id" for name, _ in page.values)


@pytest.mark.parametrize("column", COLUMNS, ids=lambda column: column.id)
def test_every_column_says_unit_direction_and_meaning_on_the_page(column):
    text = Page(html([make_table()])).text
    assert f"{column.label} {column.arrow}" in text.replace("\xa0", " ")
    for word in (column.direction, column.meaning, column.id, column.formula, column.version):
        assert word in text
    assert column.unit in text if column.unit != "1" else "none (a number)" in text


def test_everything_that_a_reader_needs_is_on_the_page():
    text = Page(html([make_table()])).text.replace("\xa0", " ")
    needed = [
        "2.91–3.80", "-0.50 to 4.10", "±0.25",  # intervals and spread
        words.BEST, words.TIED, words.INTERVALS, words.SEEDS, words.N, words.MEANS,
        *make_table().splits.values(),
        *EMPTY.values(),
        "[1] reason words", "[2] older", "note words",
        "failed: words", "2: data/words, data/b",  # cases without an answer
        "43 clips, 47 cases", "46/47", "n 45",
        "bench run words", "numpy 2", "revision beef", "2026-01-01", "1 (abcd)",
    ]  # fmt: skip
    assert [phrase for phrase in needed if " ".join(phrase.split()) not in text] == []


@pytest.mark.parametrize("form", ["text", "md", "tex", "html"])
def test_columns_of_a_breakdown_say_which_methods_are_not_ranked_and_n_what_it_counts(form):
    columns = (*(replace(column, unit="1") for column in COLUMNS[:2]), replace(COLUMNS[2], mark="control"))
    group = replace(make_table().groups[0], columns=columns, heading="kind", subject="mpjpe_h.world")
    table = replace(make_table(), groups=(group,), subjects=COLUMNS[:1])
    drawn = plain_text([table], notes=True) if form == "text" else RENDERERS[form]([table])
    shown = Page(drawn).text if form == "html" else drawn
    assert ("not ranked: control" if form == "html" else "(control)") in shown
    assert words.N_PART in " ".join(shown.split())
    assert words.N not in " ".join(shown.split())
    assert ("In a breakdown a column is a method" in shown) == (form == "html")


def test_without_intervals_seeds_and_ties_nothing_is_said_of_them():
    table = make_table()
    rows = tuple(
        replace(row, cells=tuple(replace(c, interval=None, mark="", spread=None) for c in row.cells))
        for row in table.groups[0].ranked
    )
    plain = replace(table, groups=(replace(table.groups[0], ranked=rows, unranked=()),))
    text = Page(html([plain])).text
    for legend in (words.INTERVALS, words.SEEDS, words.TIED, EMPTY["failed"]):
        assert legend not in text


def test_marks_and_gaps_are_words_not_only_colours():
    source = html([make_table()])
    best = re.search(
        r'<td data-sort="3.321" class="best" title="([^"]*)">3.32<span class="mark">\*</span>', source
    )
    assert best is not None
    assert "mean over 43 clips, 47 cases; interval 2.91–3.80" in best[1]
    assert re.search(r'class="tied"[^>]*>3.44<span class="mark">=</span>', source)
    assert re.search(r'<span class="empty">n/a</span>.*?<a href="#table-1-note-1">\[1\]</a>', source)


def test_cells_are_sorted_by_how_good_they_are():
    source = html([make_table()])
    keys = re.findall(r'<td data-sort="([^"]*)" class="[^"]*" title', source)
    assert keys[:5] == ["3.321", "1", "-0.989", "3.444", "0"]
    assert '<td class="" title="words"><span class="empty">n/a' in source  # no key: last
    directions = re.findall(r'<th scope="col" data-best="(\w+)"', source)
    assert directions[:5] == ["ascending", "ascending", "other", "descending", "ascending"]


def test_without_places_columns_with_a_goal_are_sorted_by_the_factor_that_is_missing():
    column = COLUMNS[1]
    near, half, twice, none = (float(sort_key(Cell("", v), column)) for v in (1.1, 0.5, 2.0, 0.0))
    ranked = float(sort_key(Cell("", 9.0, place=3), column))
    assert ranked < near < half == twice < none == float("inf")


ROWS = """
const cell = (tag, sort) => ({ tagName: tag, dataset: sort === null ? {} : { sort } });
function makeTable(keys) {
  const head = (best, index) => ({
    dataset: { best }, cellIndex: index, told: null,
    setAttribute(name, value) { this.told = value; }, removeAttribute() { this.told = null; },
  });
  const heads = [head("ascending", 0), head("descending", 1)];
  heads.forEach((each) => (each.parentNode = { cells: heads }));
  const body = {
    rows: keys.map(([name, key], place) => ({
      name, cells: [cell("TH", name), cell("TD", key)], dataset: { place: String(place) },
      classList: { contains: () => false },
    })),
    append(row) { this.rows = this.rows.filter((other) => other !== row).concat([row]); },
  };
  return [{ tBodies: [body] }, heads];
}
const [table, heads] = makeTable([["b", "10"], ["d", null], ["a", "9"], ["c", "9"], ["e", "Infinity"]]);
const seen = [];
for (const click of [1, 1, 1, 1, 0, 0, 0]) {
  sortBy(table, heads[click]);
  seen.push([table.tBodies[0].rows.map((row) => row.name).join(""), heads[0].told, heads[1].told]);
}
console.log(JSON.stringify(seen));
"""


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
def test_headings_sort_best_first_then_worst_then_as_it_was():
    (script,) = re.findall(r"<script>(.*?)</script>", html([make_table()]), re.DOTALL)
    completed = subprocess.run(
        ["node", "-"], input=script + ROWS, capture_output=True, text=True, check=True
    )
    assert json.loads(completed.stdout) == [
        ["acbed", None, "descending"],  # numbers, not text; equal ones as they were; no number last
        ["ebacd", None, "ascending"],
        ["bdace", None, None],
        ["acbed", None, "descending"],
        ["abcde", "ascending", None],
        ["edcba", "descending", None],
        ["bdace", None, None],
    ]
