"""The self-contained HTML report."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

import retarget_bench
from retarget_bench.figures import method_order, palette
from retarget_bench.figures.data import values
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.figures.plotting import page_svg
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.index import index, left_out
from retarget_bench.report.motions import PackedScenes
from retarget_bench.report.pictures import pictures
from retarget_bench.results.header import ResultHeader
from retarget_bench.tables.model import count
from retarget_bench.tables.rendering import as_html
from retarget_bench.viewer import player
from retarget_bench.viewer.scene_builder import Over

if TYPE_CHECKING:
    from jinja2 import Environment

PAGES = Path(__file__).parent / "pages"
SCRIPT = ("cases", "links", "begin")
"""The files of the script, in the order in which they stand in one."""


def page(
    chapters: Sequence[Chapter],
    shown: PackedScenes,
    ranked: Mapping[str, ResultHeader],
    named: Collection[str] = (),
    over: Over = iter,
) -> str:
    """The whole document. ranked: of ``method_order``, for colours. named: methods that were asked for."""
    labels = {label for chapter in chapters for label in chapter.labels}
    every = method_order.styles(ranked, named)
    styles = {label: each for label, each in every.items() if label in labels}
    script = "\n".join(_file(f"script/{name}.js") for name in SCRIPT)
    tables = [table for chapter in chapters for table in chapter.tables]
    context = as_html.context(tables) | {
        "title": "Results of motion retargeting",
        "chapters": [_chapter(chapter, styles, f"c{n}", over) for n, chapter in enumerate(chapters, 1)],
        "facts": _facts(chapters, shown),
        "shown": shown,
        "scenes": [Markup(text) for text in shown.scenes],
        "data": Markup(player.data(index(chapters, styles, shown))),
        "left_out": left_out(chapters),
        "style": Markup(_file("report.css") + _rules(styles) + (player.style() if shown.scenes else "")),
        "script": Markup(f'(() => {{\n"use strict";\n{script}\n}})();\n'),
        "player": Markup(player.script()) if shown.scenes else "",
        "shades": range(palette.SHADES),
    }
    return environment().get_template("report.html").render(context)


def _rules(styles: Mapping[str, MethodStyle]) -> str:
    """CSS of the colour scale of errors, and for methods that are switched off in a chapter's charts."""
    shades = ("#" + "".join(f"{round(255 * each):02x}" for each in rgb) for rgb in palette.shades())
    scale = "".join(f".s{step}{{--c:{colour}}}" for step, colour in enumerate(shades))
    names = (each.name for each in styles.values())
    return scale + "".join(f".off-{name} .panels .{name}{{display:none}}" for name in names)


@cache
def environment() -> Environment:
    """That of tables, with this page's templates before its own."""
    from jinja2 import ChoiceLoader, FileSystemLoader

    tables = as_html.environment()
    assert tables.loader is not None
    return tables.overlay(loader=ChoiceLoader([FileSystemLoader(PAGES, encoding="utf-8"), tables.loader]))


def _file(name: str) -> str:
    return (PAGES / name).read_text(encoding="utf-8")


GOALS = {
    "reconstruct": "Asked for was the source again, on its own body.",
    "denoise": "Asked for was the clean motion, the reference, behind a source with noise.",
    "joint-completion": "Asked for was all of a body's motion, the reference, of which the source has some "
    "joints.",
}
"""Task -> its goal, since the page begins with that of retargeting."""


def _chapter(chapter: Chapter, styles: dict[str, MethodStyle], name: str, over: Over) -> dict[str, Any]:
    """What the template takes; name: with which ids in its charts begin."""
    answering = {score.label for split in chapter.splits for score in split.section.scores if score.means}
    listed = [label for label in styles if label in answering]
    on = values.shown(listed, styles)
    why = {score.label: score.unranked for split in chapter.splits for score in split.section.scores}
    legend = [
        {
            "label": f"{label} ({why[label]})" if why[label] else label,
            "name": styles[label].name,
            "on": label in on,
            "sample": page_svg.sample(styles[label], why[label], f"{name}-legend-{number}"),
        }
        for number, label in enumerate(listed)
    ]
    return {
        "title": chapter.title,
        "asks": GOALS.get(chapter.kind, ""),
        "tables": chapter.tables,
        "pictures": pictures(chapter, styles, name, over),
        "legend": legend,
        "short": [sentence for split in chapter.splits if (sentence := _short(split))],
    }


def _short(split: Split) -> str:
    """A sentence on the best method by the main value; "" where none is ranked."""
    ranking = split.section.rankings.get(split.main.id)
    if ranking is None or len(ranking.order) < 2:
        return ""
    means = {
        score.label: score.means[split.main.id]
        for score in split.section.scores
        if score.label in ranking.order
    }
    unit = "" if split.main.unit == "1" else f" {split.main.unit}"
    also = f"; the data cannot tell {', '.join(ranking.tied)} from it" if ranking.tied else ""
    if not ranking.separable:
        also = "; so few clips cannot tell the best from the worst"
    return (
        f"{split.name}: {ranking.best} has the best {split.main.label} "
        f"({means[ranking.best].value:.{split.digits}f}{unit}) of "
        f"{count(len(ranking.order), 'ranked method')}, on {count(ranking.cases, 'case')} of "
        f"{count(ranking.clips, 'clip')}{also}."
    )


def _facts(chapters: Sequence[Chapter], shown: PackedScenes) -> list[tuple[str, str]]:
    """Results, methods, dates and versions of the page; the rest is below the tables."""
    headers = [row.header for each in chapters for split in each.splits for row in split.matrix.rows]
    dates = sorted(header.date[:10] for header in headers if header.date)
    seeds = sorted({seed for header in headers for seed in header.seeds})
    versions = dict.fromkeys(
        ", ".join(f"{name} {which}" for name, which in header.versions.items()) for header in headers
    )
    methods = list(dict.fromkeys(label for chapter in chapters for label in chapter.labels))
    cases = sum(len(split.matrix.cases) for chapter in chapters for split in chapter.splits)
    span = dates[0] if dates and dates[0] == dates[-1] else f"{dates[0]} to {dates[-1]}" if dates else ""
    facts = [
        ("results", "; ".join(chapter.title for chapter in chapters)),
        ("cases", f"{cases}, of which {count(len(shown.scenes), 'case')} can be seen in motion here"),
        ("methods", ", ".join(methods)),
        ("seeds", ", ".join(map(str, seeds))),
        ("made", span),
        ("ran with", "; ".join(each for each in versions if each)),
        (
            "this page",
            f"retarget-bench {retarget_bench.__version__}, {datetime.now(UTC).date().isoformat()}",
        ),
    ]
    return [(what, which) for what, which in facts if which]
