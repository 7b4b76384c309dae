"""Charts on pages, read back: marks stand where their numbers are, and lead to their cases."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from retarget_bench.analysis.statistics import Interval
from retarget_bench.analysis.summary import Mean
from retarget_bench.errors import printable
from retarget_bench.figures import method_order, palette
from retarget_bench.figures.data import joints, lines, rows
from retarget_bench.figures.data.model import Axis, Cases, Chart, Mark, Series
from retarget_bench.figures.data.model import Figure as FigureData
from retarget_bench.figures.plotting import drawing, page_svg
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.results import result_matrix, store
from tests.engine import test_plot_kinds
from tests.engine.stored import header

ERROR = "mpjpe_h.world"
KINDS = {
    "growth": lambda some, styles: lines.growth(some, "growth.world", styles),
    "kinds": lambda some, styles: rows.kinds(some, ERROR, styles),
    "ties": lambda some, styles: rows.ties(some, ERROR, styles),
    "speed": lambda some, styles: rows.speed(some, ERROR, styles),
    "clips": lambda some, styles: rows.clips(some, ERROR, styles),
    "levels": lambda some, styles: levels(),
}


def levels() -> FigureData:
    """A chart over levels, in which training parts a method; one is far off, and one is not ranked."""

    def series(label: str, share: float, **more) -> Series:
        marks = (
            Mark(at, Mean(share * at, 9, 9), Cases("self", "error", ("level", f"{at}"))) for at in (1, 2, 4)
        )
        return Series(label, label, tuple(marks), **more)

    at, value = Axis("before, cm", -0.1, 4.1), Axis("after, cm", -0.1, 4.3)
    drawn = (
        series("a", 0.5),
        series("a", 0.75, unseen=True),
        series("b", 3.0),
        series("c", 0.2, unranked="control"),
    )
    ticks = ("noise, cm", ((1.0, "0.5"), (4.0, "2")))
    chart = Chart("self", "self", at, value, drawn, joined=True, guide=((0, 0), (4, 4)), above=ticks)
    return FigureData("denoise", "data", "levels", (chart,))


@pytest.fixture(scope="module")
def numbers(tmp_path_factory):
    """A folder of results, and label -> pair and clip -> what is stored."""
    root = tmp_path_factory.mktemp("pages")
    return root, test_plot_kinds.stored(root)


@pytest.fixture(scope="module")
def matrices(numbers):
    return result_matrix.result_matrices(store.find_results(numbers[0]))


@pytest.fixture(scope="module")
def styles(matrices):
    ranked = {row.label: row.header for each in matrices for row in each.rows}
    return method_order.styles(ranked | {label: header(label, [], "self") for label in "abc"})


def said(mark: Mark) -> str:
    return f"{mark.mean.value!r}"


def drawn(chart: Chart, styles, name: str = "c1") -> ElementTree.Element:
    return ElementTree.fromstring(str(page_svg.chart(chart, styles, name, said)))


def uses(page: ElementTree.Element) -> list[tuple[ElementTree.Element, ElementTree.Element]]:
    """Groups of marks, each with its marks."""
    return [(group, use) for group in page.iter("g") for use in group.findall("use")]


BASE = 2.6
"""Units from the line on which small letters stand up to their middle."""


def scale(page: ElementTree.Element, chart: Chart, which: str) -> np.poly1d:
    """From places on the page to numbers (to their logarithms), by the words beside an axis."""
    axis, anchor = (chart.x, "middle") if which == "x" else (chart.y, "end")
    known = {text: at for at, text in axis.ticks}
    points = []
    for each in page.iter("text"):
        words, style = (each.text or "").replace(",", ""), each.get("style", "")
        y = float(each.get("y", "")) - BASE
        if f"text-anchor:{anchor}" not in style or "7px" not in style or (which == "x" and y < 50):
            continue  # titles, and the axis above
        if which == "y" and chart.rows:
            points.append((y, float(len(points))))
        else:
            number = known[words] if known else float(words)
            points.append((float(each.get("x", "")) if which == "x" else y, number))
    assert len(points) >= 2
    places, numbers = np.array(points).T
    return np.poly1d(np.polyfit(places, np.log10(numbers) if axis.log else numbers, 1))


@pytest.mark.parametrize("kind", KINDS)
def test_marks_stand_where_their_numbers_are(kind, matrices, styles):
    for chart in KINDS[kind](matrices, styles).charts:
        page = drawn(chart, styles)
        marks = [
            (printable(series.method), mark)
            for series in chart.series
            for group in series.groups(chart.value).values()
            for mark in group
        ]
        found = uses(page)
        assert [group.get("data-method") for group, _ in found] == [label for label, _ in marks]
        words = [use.get("aria-label", "").rpartition(": ")[2] for _, use in found]
        assert words == [said(mark) for _, mark in marks]
        numbers = np.array([min(mark.mean.value, chart.value.high) for _, mark in marks])
        places = np.array([mark.at for _, mark in marks])
        expected = {"x": numbers, "y": places} if chart.rows else {"x": places, "y": numbers}
        for which, axis in (("x", chart.x), ("y", chart.y)):
            at = np.array([float(use.get(which, "")) for _, use in found])
            counted = np.log10 if axis.log else np.asarray
            close = 0.02 * float(np.ptp(counted([axis.low, axis.high])))
            assert scale(page, chart, which)(at) == pytest.approx(counted(expected[which]), abs=close)


def test_what_leads_to_cases_says_which(matrices, styles):
    (chart,) = rows.clips(matrices, ERROR, styles).charts
    page = drawn(chart, styles)
    assert (page.get("data-split"), page.get("data-value")) == ("cross", ERROR)
    clips = {info.clip for info in matrices[0].cases}
    assert {use.get("data-clip") for _, use in uses(page)} == clips
    (chart,) = lines.growth(matrices, "growth.world", styles).charts
    (_, first), *_ = uses(drawn(chart, styles))
    numbers = matrices[0].numbers(("growth.world", "1"))[0]
    worst = [pair.split(":") for pair in first.get("data-worst").split()]
    assert [float(number) for _, number in worst] == pytest.approx(sorted(numbers)[-6:][::-1], abs=1e-3)
    assert [numbers[int(case)] for case, _ in worst] == pytest.approx(sorted(numbers)[-6:][::-1])
    assert first.get("data-what") == "error over time at 1"


def test_all_that_belongs_to_a_method_has_its_class_and_what_is_not_ranked_is_hollow(styles):
    (chart,) = levels().charts
    page = drawn(chart, styles)
    for label in "abc":
        own = [group for group in page.iter("g") if group.get("class") == styles[label].name]
        assert {group.get("data-method") for group in own} <= {None, label}
        paths = [each for group in own for each in group.findall("path")]
        assert len(paths) == (2 if label == "a" else 1)
    fills = {
        group.get("data-method"): re.search("fill:(#\\w+)", group.get("style"))[1]
        for group, _ in uses(page)
    }
    assert fills == {"a": styles["a"].colour, "b": styles["b"].colour, "c": "#ffffff"}
    assert "c (control): " in next(
        use.get("aria-label") for group, use in uses(page) if group.get("data-method") == "c"
    )


def test_intervals_are_whiskers_and_ids_are_there_once(styles):
    (chart,) = levels().charts
    sure = Mean(2.0, 20, 20, Interval(1.0, 3.0))
    series = replace(
        chart.series[0], marks=tuple(replace(mark, mean=sure) for mark in chart.series[0].marks)
    )
    chart = replace(chart, series=(series, *chart.series[1:]))
    pages = [
        ElementTree.fromstring(str(page_svg.chart(chart, styles, name, said))) for name in ("c1", "c2")
    ]
    ids = [each.get("id") for page in pages for each in page.iter() if each.get("id")]
    assert len(ids) == len(set(ids))
    used = {each.get("href", "")[1:] for page in pages for each in page.iter("use")}
    clipped = {
        each.get("clip-path", "")[5:-1] for page in pages for each in page.iter() if each.get("clip-path")
    }
    assert used | clipped <= set(ids)
    line, whiskers, *_ = (path for group in pages[0].iter("g") for path in group.findall("path"))
    assert len(re.findall("[ML]", line.get("d", ""))) == 3
    ends = np.array([float(y) for y in re.findall(r"[ML][\d.]+ ([\d.]+)", whiskers.get("d", ""))])
    assert scale(pages[0], chart, "y")(ends) == pytest.approx([1.0, 3.0] * 3, abs=0.1)


def test_skeletons_are_coloured_and_sized_by_the_errors_of_their_joints(numbers, matrices, styles):
    tree = Skeleton(("Hips", "Head"), np.array([-1, 0]), np.array([[0.0, 1.0, 0.0], [0.1, 0.6, 0.0]]))
    bodies = {name: Character.of(name, tree) for name in ("ann", "bob")}
    data = joints.skeletons(matrices[0], "mpjpe_h.joint", bodies, styles)
    assert [chart.method for chart in data.skeletons] == list(test_plot_kinds.HOSTILE)
    keep = lambda s, t, _: t in ("ann", "bob")  # noqa: E731
    for chart in data.skeletons:
        entries = numbers[1][chart.method]
        expected = {j: test_plot_kinds.mean(entries, "mpjpe_h.joint", j, keep) for j in ("Hips", "Head")}
        assert {mark.name: mark.mean.value for mark in chart.marks} == pytest.approx(expected)
        page = ElementTree.fromstring(str(page_svg.skeleton(chart, styles, "c1", said)))
        assert page.get("class") == f"chart {styles[chart.method].name}"
        found = {
            use.get("aria-label").split(", ")[-1].split(":")[0]: (group, use) for group, use in uses(page)
        }
        (hips, low), (head, high) = found["Hips"], found["Head"]
        across, up = (float(high.get(key)) - float(low.get(key)) for key in "xy")
        assert across / up == pytest.approx(-0.1 / 0.6, abs=0.01)
        shades = [f"#{''.join(f'{round(255 * each):02x}' for each in rgb)}" for rgb in palette.shades()]
        for group, joint in ((hips, "Hips"), (head, "Head")):
            fill = re.search("fill:(#\\w+)", group.get("style"))[1]
            assert shades.index(fill) == palette.shade(expected[joint] / chart.errors.high)


def test_names_of_rows_are_short_enough_and_whole_where_there_is_room():
    assert drawing.row_name("copy_rotations", 3.25) == "copy_rotations"
    short = drawing.row_name("copy_rotations+footfix[steps=200,rate=0.5]", 3.25)
    assert len(short) <= 21
    assert short.startswith("copy_rota")
    assert short.endswith("=0.5]")
