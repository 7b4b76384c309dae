"""Files and pages draw the same data: the same order, numbers and limits, for every kind of chart."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from retarget_bench.analysis.summary import Mean
from retarget_bench.errors import printable
from retarget_bench.figures import method_order
from retarget_bench.figures.data import bodies, lines, rows
from retarget_bench.figures.data.model import (
    Axis,
    BoxChart,
    Cases,
    HeatMap,
    Line,
    LineChart,
    Mark,
    PointChart,
    RowChart,
    SkeletonChart,
)  # fmt: skip
from retarget_bench.figures.data.model import Figure as FigureData
from retarget_bench.figures.plotting import canvas, drawing
from retarget_bench.figures.svg import charts as pages
from retarget_bench.figures.svg.charts import Drawing
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.results import result_matrix, store
from tests.engine import test_plot_kinds

ERROR = "mpjpe_h.world"


def noise(matrices) -> FigureData:
    """A chart over levels, in which training parts a method."""

    def line(label: str, share: float, seen: bool | None = None) -> Line:
        marks = [
            Mark(label, at, Mean(share * at, 9, 9), Cases("self", part=("level", f"{at}")))
            for at in (1, 2, 4)
        ]
        return Line(label, label, tuple(marks), seen)

    ends = Axis("before", -0.1, 4.1), Axis("after", -0.1, 4.3)
    drawn = line("a", 0.5, True), line("a", 0.75, False), line("b", 1.0)
    headers = test_plot_kinds.about(a=False, b=True)
    return FigureData(
        "denoise", "data", "levels", headers, (LineChart("self", "self", *ends, drawn, True),)
    )


def skeletons(matrices) -> FigureData:
    tree = Skeleton(("Hips", "Head"), np.array([-1, 0]), np.array([[0.0, 1.0, 0.0], [0.1, 0.6, 0.0]]))
    return bodies.skeletons(
        matrices, "mpjpe_h.joint", {name: Character.of(name, tree) for name in ("ann", "bob")}, "s17"
    )


KINDS = {
    "denoise": noise,
    "growth": lambda some: lines.growth(some, "growth.world"),
    "kinds": lambda some: rows.kinds(some, ERROR),
    "ties": lambda some: rows.ties(some, ERROR),
    "speed": lambda some: rows.speed(some, ERROR),
    "clips": lambda some: rows.clips(some, ERROR),
    "pairs": lambda some: bodies.pairs(some, ERROR),
    "joints": skeletons,
}


@pytest.fixture(scope="module")
def matrices(tmp_path_factory):
    root = tmp_path_factory.mktemp("both")
    test_plot_kinds.stored(root)
    return result_matrix.result_matrices(store.find_results(root))


def on_page(data: FigureData, chart) -> ElementTree.Element:
    drawing = Drawing(method_order.styles(data.methods), {}, {})
    return ElementTree.fromstring(str(drawing.chart(chart)))


def axis(drawn: ElementTree.Element, anchor: str, log: bool = False) -> np.poly1d:
    """From places to numbers, by the ticks that stand to the left (``end``) or below (``middle``)."""
    points = []
    for each in drawn.iter("text"):
        if each.get("text-anchor") == anchor and not each.get("class") and each.get("x") != "0":
            number = float((each.text or "").replace(",", ""))
            at = float(each.get("y", "")) - 3.5 if anchor == "end" else float(each.get("x", ""))
            points.append((at, np.log10(number) if log else number))
    assert len(points) >= 3
    places, numbers = zip(*points, strict=True)
    return np.poly1d(np.polyfit(places, numbers, 1))


def said(label: str) -> float:
    """The first number after the colon."""
    return float(re.search(r": ([\d.]+)", label)[1])


def picks(drawn: ElementTree.Element) -> list[ElementTree.Element]:
    return [each for each in drawn.iter("g") if each.get("class") == "pick"]


def places(drawn: ElementTree.Element) -> np.ndarray:
    """Where the marks that lead to cases stand, in units of the chart."""
    transforms = [[path.get("transform", "") for path in each.iter("path")][-1] for each in picks(drawn)]
    return np.array([[float(n) for n in re.findall(r"-?[\d.]+", each)[:2]] for each in transforms])


def marked(axes) -> list:
    return [line for line in axes.lines if line.get_marker() not in ("None", None) and line.get_clip_on()]


@pytest.mark.parametrize("kind", KINDS)
def test_both_draw_the_same_marks_in_the_same_order_within_the_same_limits(
    kind, matrices, tmp_path, figures
):
    data = KINDS[kind](matrices)
    drawing.draw(tmp_path / "a.png", data)
    for axes, chart in zip(figures[0].axes, data.charts, strict=False):
        page = on_page(data, chart)
        match chart:
            case LineChart():
                marks = [mark for line in chart.lines for mark in line.marks]
                drawn = np.concatenate([line.get_xydata() for line in marked(axes)])
                assert drawn == pytest.approx(np.array([(mark.at, mark.mean.value) for mark in marks]))
                diagonals = [each for each in page.iter("line") if each.get("class") == "diagonal"]
                assert len(diagonals) == chart.diagonal
                for each in diagonals:
                    along, up = (axis(page, which) for which in ("middle", "end"))
                    ends = [(along(float(each.get(f"x{k}"))), up(float(each.get(f"y{k}")))) for k in "12"]
                    most = min(chart.x.high / 1.02, chart.y.high)
                    assert ends == [pytest.approx((value, value), abs=0.01 * most) for value in (0, most)]
                numbers = np.stack(
                    [axis(page, "middle")(places(page)[:, 0]), axis(page, "end")(places(page)[:, 1])], 1
                )
                assert numbers == pytest.approx(drawn, abs=0.01 * drawn.max())
                ends = axis(page, "middle")(np.array([pages.LEFT, pages.RIGHT]))
                assert ends == pytest.approx(axes.get_xlim(), abs=0.01 * drawn.max())
                assert axis(page, "end")(np.array([pages.BOTTOM, pages.TOP])) == pytest.approx(
                    axes.get_ylim(), abs=0.01 * drawn.max()
                )
            case RowChart():
                marks = [mark for each in chart.marks.values() for mark in each]
                drawn = np.concatenate([line.get_xdata() for line in marked(axes)])
                assert drawn == pytest.approx([mark.mean.value for mark in marks])
                read = axis(page, "middle")
                assert read(places(page)[:, 0]) == pytest.approx(drawn, abs=0.01 * drawn.max())
                ends = read(np.array([pages.NAMES, pages.ROW_WIDTH - 12]))
                assert ends == pytest.approx(axes.get_xlim(), abs=0.01 * drawn.max())
                names = [each.text for each in page.iter("text") if each.get("text-anchor") == "end"]
                assert [canvas.drawable(name) for name in chart.rows] == [
                    t.get_text() for t in axes.get_yticklabels()
                ]
                assert len(names) == len(chart.rows)
            case PointChart():
                marks = list(chart.marks)
                drawn = np.concatenate([line.get_xydata() for line in marked(axes)])
                assert drawn == pytest.approx(np.array([(mark.at, mark.mean.value) for mark in marks]))
                assert axis(page, "end")(places(page)[:, 1]) == pytest.approx(
                    drawn[:, 1], abs=0.01 * drawn[:, 1].max()
                )
                (front,) = (each for each in page.iter("path") if each.get("class") == "front")
                heights = [float(y) for _, y in re.findall(r"([\d.]+) ([\d.]+)", front.get("d", ""))[1::2]]
                assert axis(page, "end")(np.array(heights)) == pytest.approx(
                    [mark.mean.value for mark in chart.front], abs=0.01 * drawn[:, 1].max()
                )
                assert axes.get_xlim() == pytest.approx((chart.x.low, chart.x.high))
                assert axes.get_ylim() == pytest.approx((chart.y.low, chart.y.high))
            case BoxChart():
                marks = [mark for box in chart.boxes for mark in box.marks]
                dots = [line for line in axes.lines if line.get_marker() in ("o", ">")]
                drawn = np.concatenate([line.get_xdata() for line in dots])
                read = axis(page, "middle")
                assert read(places(page)[:, 0]) == pytest.approx(drawn, abs=0.01 * drawn.max())
                assert axes.get_xlim() == pytest.approx((chart.axis.low, chart.axis.high))
            case HeatMap():
                marks = list(chart.squares.values())
                drawn = np.ma.compressed(axes.get_images()[0].get_array())
                assert sorted(drawn) == pytest.approx(sorted(mark.mean.value for mark in marks))
                assert axes.get_images()[0].get_clim() == (chart.scale.low, chart.scale.high)
            case SkeletonChart():
                marks = list(chart.marks)
                dots = axes.collections[1]
                assert dots.get_array().tolist() == [mark.mean.value for mark in marks]
                assert dots.get_clim() == (chart.scale.low, chart.scale.high)
        assert [each.get("data-method") for each in picks(page)] == [
            printable(mark.method) for mark in marks
        ]
        assert [
            said(f": {each.get('aria-label').rpartition(': ')[2]}") for each in picks(page)
        ] == pytest.approx([mark.mean.value for mark in marks], abs=6e-4)


def test_no_kind_is_left_out(matrices):
    assert {type(chart) for make in KINDS.values() for chart in make(matrices).charts} == set(
        drawing.BACKENDS
    )
