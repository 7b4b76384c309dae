"""Pictures of plain results: what is drawn is what the stored numbers give, counted again by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

from retarget_bench import cli
from retarget_bench.analysis.statistics import Interval
from retarget_bench.analysis.summary import Mean
from retarget_bench.api import CaseInfo
from retarget_bench.evaluation import timing
from retarget_bench.figures import method_order, palette
from retarget_bench.figures.axis_limits import MARGIN, ROOM, limits
from retarget_bench.figures.data import lines as line_charts
from retarget_bench.figures.data import rows, values
from retarget_bench.figures.data.model import Axis, Cases, Chart, Mark, Series
from retarget_bench.figures.data.model import Figure as FigureData
from retarget_bench.figures.plotting import canvas, drawing
from retarget_bench.results import result_matrix as panel
from retarget_bench.results import store
from retarget_bench.results.header import parsed
from retarget_bench.results.store import CaseResult, ResultPaths
from tests.engine.stored import header, metadata
from tests.engine.stored import store as stored_rows

HOSTILE = ("$\\frac{1}", "_hidden & 50% #1", "<script>alert('x')</script>\n\x07")
BODIES = ("ann", "bob", "$\\cat_^")
STRUCTURES = {"ann": "s17", "bob": "s17", "$\\cat_^": "s22"}
JOINTS = {"s17": ("Hips", "Head"), "s22": ("Hips", "Head", "Toe^{$")}
KINDS = ("walk", "run", "$\\sit$")
LOWER = header("", [], "cross").values["mpjpe_h.world"]
VALUES = {
    key: {
        "label": label, "unit": "% of height", "better": "lower", "goal": 1.0, "index": index,
        "with_self": False, "meaning": "", "tolerance": 1e-6, "formula": "", "metric": "m",
    }
    for key, label, index in (
        ("mpjpe_h.world", "error", ""), ("mpjpe_h.joint", "error by joint", "joint"),
        ("growth.world", "error over time", "second"),
    )
}  # fmt: skip
CLIPS = 12
FPS = dict(zip(HOSTILE, (2000.0, 500.0, 40.0), strict=True))
Numbers = dict[str, dict[tuple[str, str, int], CaseResult]]


def stored(root: Path) -> Numbers:
    """Three methods with names that mean something to TeX or HTML, of three bodies; and their numbers."""
    rng = np.random.default_rng(11)
    numbers: Numbers = {}
    pairs = [(a, b) for a in BODIES for b in BODIES if a != b]
    for shift, label in enumerate(HOSTILE):
        entries, infos = {}, []
        for clip in range(CLIPS):
            for source, target in pairs if clip else pairs[:2]:
                info = CaseInfo(
                    f"data/{source}>{target}/clip {clip:02}", "retarget", "cross", source, target,
                    f"clip {clip:02}", KINDS[clip % 3], 90,
                )  # fmt: skip
                error = float(1 + shift + clip % 3 + rng.random())
                values = {
                    "mpjpe_h.world": error,
                    "mpjpe_h.joint": {j: error * (k + 1) for k, j in enumerate(JOINTS[STRUCTURES[target]])},
                    "growth.world": {str(second): error * second for second in (1, 2, 3)},
                }
                infos.append(info)
                entries[source, target, clip] = CaseResult(info.id, "ok", values=values)
        place = ResultPaths(root, "data", "retarget", "cross", f"method{shift}")
        plain = asdict(header(label, list(entries.values()), "cross")) | {"values": VALUES}
        plain["dataset"] |= {"label": "50% of {data}_$x", "name": "no_such_data"}
        described = parsed(plain)
        store.write_results(place, described, list(entries.values()), infos)
        timing.write(place, [timing.Time("c", round(FPS[label]), 1.0, 0.0)])
        numbers[label] = entries
    metadata(place, structure={body: STRUCTURES[body] for body in BODIES})
    return numbers


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> tuple[Path, Numbers]:
    root = tmp_path_factory.mktemp("kinds")
    return root, stored(root)


@pytest.fixture
def plotted(results, tmp_path, figures) -> Callable[..., Figure]:
    """Draws a kind by the command, and gives the figure."""

    def plot(kind: str, *more: str) -> Figure:
        with pytest.raises(SystemExit) as stop:
            cli.main(["plot", kind, "-r", str(results[0]), "-o", str(tmp_path / "out.svg"), *more])
        assert not stop.value.code
        return figures[-1]

    return plot


def mean(
    entries: dict, value: str, index: str = "", keep: Callable[[str, str, int], bool] = lambda *_: True
) -> float:
    """Over clips of the mean over the cases of a clip, as a plain loop."""
    clips: dict[int, list[float]] = {}
    for (source, target, clip), entry in entries.items():
        number = entry.values[value]
        number = number.get(index) if isinstance(number, dict) else number
        if keep(source, target, clip) and number is not None:
            clips.setdefault(clip, []).append(number)
    return sum(sum(each) / len(each) for each in clips.values()) / len(clips)


def lines(axes) -> list:
    return [line for line in axes.lines if line.get_marker() not in ("None", None)]


# -------------------------------------------------------------------------------------------------- kinds
@pytest.mark.parametrize(("bodies", "shown"), [("people", 1.5), ("mixed", 4.0), ("all", 2.5)])
def test_people_are_drawn_unless_other_bodies_are_asked_for(tmp_path, figures, bodies, shown):
    cases = [("ann>bob", "c1"), ("bob>ann", "c2"), ("rex>rex", "c3"), ("ann>rex", "c4")]
    numbers = [(*case, {"mpjpe_h.world": 1.0 + n}) for n, case in enumerate(cases)]
    for method in ("one", "two"):
        place = stored_rows(tmp_path, "cross", method, numbers)
    metadata(place, legs={"ann": "2", "bob": "2", "rex": "4"})
    asked = [] if bodies == "people" else ["--bodies", bodies]
    with pytest.raises(SystemExit) as stop:
        cli.main(["plot", "methods", "-r", str(tmp_path), "-o", str(tmp_path / "out.svg"), *asked])
    assert not stop.value.code
    assert lines(figures[0].axes[0])[0].get_xdata()[0] == pytest.approx(shown)
    assert figures[0].get_suptitle().startswith("data: " if bodies == "all" else f"data: {bodies}:")


def test_ties_show_the_order_and_nobody_joined_who_is_told_apart(plotted, results):
    axes = plotted("methods").axes[0]
    expected = sorted((mean(entries, "mpjpe_h.world"), label) for label, entries in results[1].items())
    assert [text.get_text() for text in axes.get_yticklabels()] == [
        canvas.drawable(label) for _, label in expected
    ]
    assert [line.get_xdata()[0] for line in lines(axes)] == pytest.approx([value for value, _ in expected])
    assert not [line for line in axes.lines if len(line.get_xdata()) == 2]  # no bar of ties


def test_speed_is_to_the_right_and_error_upwards(results):
    (chart,) = rows.speed(panel.result_matrices(store.find_results(results[0])), "mpjpe_h.world", {}).charts
    assert chart.x.log
    for series, (label, entries) in zip(chart.series, results[1].items(), strict=True):
        (mark,) = series.marks
        assert series.method == label
        assert mark.at == pytest.approx(FPS[label])
        assert mark.mean.value == pytest.approx(mean(entries, "mpjpe_h.world"))


def test_who_is_slower_and_worse_is_not_at_the_front():
    points = [(100.0, 3.0), (10.0, 2.0), (5.0, 2.5), (1.0, 1.0), (1.0, 4.0)]
    assert front(points, "lower") == [(1.0, 1.0), (10.0, 2.0), (100.0, 3.0)]
    assert front(points, "higher") == [(1.0, 4.0), (100.0, 3.0)]
    assert front([(1.0, 1.1), (2.0, 0.5)], "target")[0] == (1.0, 1.1)


def front(points: list[tuple[float, float]], better: str) -> list[tuple[float, float]]:
    marks = [Mark(fps, Mean(number, 9, 9), Cases("cross")) for fps, number in points]
    return [(mark.at, mark.mean.value) for mark in rows.best(marks, replace(LOWER, better=better))]


def test_kinds_stand_with_the_farthest_off_at_the_top(results):
    (chart,) = rows.kinds(panel.result_matrices(store.find_results(results[0])), "mpjpe_h.world", {}).charts
    assert chart.at.ticks == ((0, "$\\sit$"), (1, "run"), (2, "walk"))
    for series, (label, entries) in zip(chart.series, results[1].items(), strict=True):
        assert series.method == label
        for (at, kind), mark in zip(chart.at.ticks, series.marks, strict=True):
            expected = mean(entries, "mpjpe_h.world", keep=lambda s, t, c, k=kind: KINDS[c % 3] == k)
            assert mark.mean.value == pytest.approx(expected)
            assert (round(mark.at), mark.name) == (at, kind)


def test_growth_is_a_line_over_seconds(plotted, results):
    axes = plotted("growth").axes[0]
    for line, entries in zip(lines(axes), results[1].values(), strict=True):
        assert list(line.get_xdata()) == [1, 2, 3]
        expected = [mean(entries, "growth.world", str(second)) for second in (1, 2, 3)]
        assert line.get_ydata() == pytest.approx(expected)


# ------------------------------------------------------------------------------- what is shown when
@pytest.fixture(scope="module")
def mixed(tmp_path_factory) -> Path:
    """Results of two methods, a variant, a control, a method that sees more, and one with few answers."""
    root = tmp_path_factory.mktemp("mixed")
    errors = {
        "ik": 1.0, "copy_rotations": 2.0, "copy_rotations[root_rule=none]": 19.0, "rest_pose": 30.0,
        "told": 0.5, "lazy": 0.1,
    }  # fmt: skip
    for label, error in errors.items():
        found = [("a>b", f"c{k:02}", {"mpjpe_h.world": error + 0.01 * k}) for k in range(12)]
        rows = (
            [*found[:8], *((*each[:2], "unsupported") for each in found[8:])] if label == "lazy" else found
        )
        more = {"control": label == "rest_pose", "privileged": ("contacts",) if label == "told" else ()}
        if "[" in label:
            more |= {"name": "copy_rotations", "parameters": {"root_rule": "none"}}
        stored_rows(root, "cross", label, rows, **more)
    return root


@pytest.mark.parametrize(
    ("asked", "shown"),
    [
        ([], ["ik", "copy_rotations", "lazy (answered 8 of 12)", "told (sees contacts)"]),
        (["-m", "ik", "-m", "rest_pose"], ["ik", "rest_pose (control)"]),
        (["-m", "copy_rotations[root_rule=none]"], ["copy_rotations[root_rule=none]"]),
    ],
)
def test_controls_and_variants_are_drawn_where_they_are_asked_for(mixed, tmp_path, figures, asked, shown):
    with pytest.raises(SystemExit) as stop:
        cli.main(["plot", "methods", "-r", str(mixed), "-o", str(tmp_path / "out.svg"), *asked])
    assert not stop.value.code
    axes = figures[-1].axes[0]
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert sorted(names) == sorted(shown)
    assert ("hollow: not ranked" in figures[-1].get_suptitle()) is any("(" in name for name in names)
    for name, line in zip(names, lines(axes), strict=True):
        assert (line.get_markerfacecolor() == "white") is ("(" in name)
        assert (line.get_color() in palette.COLOURS) is not ("rest_pose" in name or "none" in name)


def test_variants_are_grey_where_all_are_asked_for_and_methods_keep_their_colours(mixed, tmp_path, figures):
    seen = []
    for more in ([], ["--variants"]):
        with pytest.raises(SystemExit) as stop:
            cli.main(["plot", "methods", "-r", str(mixed), "-o", str(tmp_path / "out.svg"), *more])
        assert not stop.value.code
        axes = figures[-1].axes[0]
        names = [text.get_text() for text in axes.get_yticklabels()]
        seen.append(dict(zip(names, (each.get_color() for each in lines(axes)), strict=True)))
    plain, varied = seen
    assert varied.pop("copy_rotations[root_rule=none]") in palette.CONTROLS
    assert varied == plain


# ------------------------------------------------------------------------------- what is not comparable
def only(root: Path) -> panel.ResultMatrix:
    (matrix,) = panel.result_matrices(store.find_results(root))
    return matrix


def test_a_speed_of_a_slower_moment_is_left_out_and_a_note_says_so(tmp_path):
    for label, yardstick in (("quick", 0.01), ("even", 0.011), ("busy", 0.05)):
        found = [("a>b", f"c{k}", {"mpjpe_h.world": 1.0 + k}) for k in range(12)]
        timing.write(stored_rows(tmp_path, "cross", label, found), [timing.Time("c", 300, 1.0, yardstick)])
    figure = rows.speed([only(tmp_path)], "mpjpe_h.world", {})
    assert {series.method for series in figure.charts[0].series} == {"quick", "even"}
    assert any(
        "left out of cross: busy, timed when the machine was 5.0 times" in note for note in figure.notes
    )


def test_means_over_other_cases_are_not_drawn(tmp_path):
    for label, count in (("all", 12), ("few", 9)):
        values_of = [{"mpjpe_h.world": 1.0 + k} if k < count else {"ratio": 1.0} for k in range(12)]
        stored_rows(
            tmp_path, "cross", label, [("a>b", f"c{k:02}", each) for k, each in enumerate(values_of)]
        )
    matrix = only(tmp_path)
    assert {label: mean.value for label, mean in values.means(matrix, "mpjpe_h.world").items()} == {
        "all": 6.5
    }
    (series,) = rows.kinds([matrix], "mpjpe_h.world", {}).charts[0].series
    assert series.method == "all"
    boxes = rows.clips([matrix], "mpjpe_h.world", {}).charts[0].series
    assert {each.method: each.unranked for each in boxes} == {"all": "", "few": "has it for 9 of 12 cases"}


@pytest.mark.parametrize(("clips", "seconds"), [(12, [1, 2]), (5, [1, 2, 3])])
def test_curves_end_where_too_few_clips_are_left_for_an_interval(tmp_path, clips, seconds):
    short, long = ({str(second): 1.0 * second for second in range(1, end)} for end in (3, 4))
    found = [("a>b", f"c{k:02}", {"curve": long if k < 3 else short}) for k in range(clips)]
    stored_rows(tmp_path, "cross", "one", found)
    matrix = only(tmp_path)
    declared = {**matrix.values, "curve": replace(matrix.values["curve"], index="second")}
    (chart,) = line_charts.growth([replace(matrix, values=declared)], "curve", {}).charts
    assert [mark.at for mark in chart.series[0].marks] == seconds


# ----------------------------------------------------------------------------------------------- the page
@pytest.mark.parametrize(("kind", "width"), [("growth", "column"), ("methods", "page")])
def test_pictures_are_as_wide_as_is_asked(plotted, kind, width):
    figure = plotted(kind, "--width", width)
    assert figure.get_figwidth() == {"column": 3.25, "page": 6.75}[width]
    assert figure.get_suptitle()
    assert not plotted(kind, "--no-title").get_suptitle()


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize("kind", ["methods", "growth"])
def test_words_stay_words_in_every_kind(results, tmp_path, kind):
    """PDFs embed TrueType and no outlines (Type 3), SVG has text; nothing is a picture of letters."""
    for form in ("svg", "pdf"):
        with pytest.raises(SystemExit) as stop:
            cli.main(["plot", kind, "-r", str(results[0]), "-o", str(tmp_path / f"out.{form}")])
        assert not stop.value.code
    drawn = ElementTree.parse(tmp_path / "out.svg")
    assert not [each for each in drawn.iter() if str(each.tag).lower().endswith("script")]
    words = "".join(
        "".join(each.itertext()) + "\n" for each in drawn.iter("{http://www.w3.org/2000/svg}text")
    )
    assert all(canvas.drawable(name) in words for name in HOSTILE)
    assert "50% of {data}_$x" in words
    pdf = (tmp_path / "out.pdf").read_bytes()
    assert b"/FontFile2" in pdf
    assert b"/Type3" not in pdf


# ------------------------------------------------------------------------------------------------ the edge
def test_what_is_far_worse_is_an_arrowhead_at_the_edge(tmp_path, figures):
    means = {"a": [Mean(2.0, 9, 9)], "b": [Mean(3.0, 9, 9)], "far": [Mean(291.4, 9, 9)]}
    low, end = limits(means, LOWER)
    assert (low, end) == (-MARGIN * end, ROOM * 3.0)
    series = tuple(
        Series(label, label, (Mark(0, each, Cases("cross")),)) for label, (each,) in means.items()
    )
    at = Axis("", -0.5, 0.5, ticks=((0, "walk"),))
    chart = Chart("cross", "cross", at, Axis("error", low, end), series, rows=True)
    data = FigureData("kinds", "data", "by kind", (chart,))
    styles = method_order.styles({label: header(label, [], "cross") for label in means})
    drawing.draw(tmp_path / "a.png", data, styles)
    (axes,) = figures[0].axes
    assert axes.get_xlim() == (low, end)
    assert [(line.get_marker(), *line.get_xdata()) for line in lines(axes)] == [
        ("o", 2.0), ("s", 3.0), (">", end),
    ]  # fmt: skip
    assert "arrowheads: off the scale" in figures[0].get_suptitle()


@pytest.mark.parametrize(
    ("declared", "numbers"),
    [(replace(LOWER, better="higher"), (0.1, 0.1, 0.9)), (replace(LOWER, better="none"), (1.0, 1.0, 90.0)),
     (LOWER, (1.0, 1.0, 2.4))],
)  # fmt: skip
def test_axes_without_anything_far_worse_show_everything(declared, numbers):
    low, end = limits(
        {name: [Mean(each, 9, 9)] for name, each in zip("abc", numbers, strict=True)}, declared
    )
    assert low <= 0 < max(numbers) < end


def test_intervals_of_what_stands_within_lengthen_an_axis_up_to_twice():
    far = [Mean(90.0, 20, 20, Interval(50.0, 99.0))]
    plain = [Mean(2.0, 20, 20)]
    means = {"a": [Mean(2.0, 20, 20, Interval(1.0, 7.0))], "b": plain, "c": far}
    assert limits(means, LOWER)[1] == 7.0
    assert limits(means, LOWER, bands=True)[1] == 5.0
    means["a"] = [Mean(2.0, 20, 20, Interval(1.0, 700.0))]
    assert limits(means, LOWER)[1] == 10.0


@pytest.mark.parametrize(
    ("name", "shown"),
    [("_x", "\u200a_x"), ("a\nb\x00", "a b"), ("", "(no name)"), ("\ud800", "?"), ("é 日本", "é 日本")],
)
def test_names_are_one_line_that_legends_show(name, shown):
    assert canvas.drawable(name) == shown
    assert len(canvas.drawable("x" * 500)) <= canvas.LONGEST


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["methods", "-o", "a.png", "--columns", "mpjpe_h.word"],
            "no result has mpjpe_h.word as one number per case",
        ),
        (["growth", "-o", "a.png", "--columns", "mpjpe_h.world"], "such as growth.world"),
        (["recall", "-o", "a.png", "--columns", "mpjpe_h.world"], "recall is drawn over speeds, or over"),
        (["levels", "-o", "a.png", "--columns", "mpjpe_h.world"], "--columns is for bench plot methods,"),
        (["methods", "-o", "a.png", "--at", "1"], "--at is for bench plot attention, and not for methods"),
        (["growth", "-o", "a.jpg"], "pictures are written as .png, .pdf, .svg"),
        (
            ["methods", "-o", "a.png", "-s", "self"],
            "no results of split 'self' here; there are cross",
        ),
        (["growth", "-o", "a.png", "-d", "b", "-s", "self"], "no results of b in"),
    ],
)
def test_what_cannot_be_drawn_is_a_sentence(results, tmp_path, monkeypatch, capsys, arguments, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        cli.main(["plot", *arguments, "-r", str(results[0])])
    assert stop.value.code == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
