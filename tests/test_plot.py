"""Pictures of results: what is drawn is what the rows say, and what cannot be drawn is told."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.text import Text
from scipy import optimize

from retarget_bench import cli
from retarget_bench.analysis import summary
from retarget_bench.analysis.selection import Selection
from retarget_bench.analysis.statistics import Interval
from retarget_bench.analysis.summary import Mean, MethodSummary, SplitSummary
from retarget_bench.errors import BenchError
from retarget_bench.figures.data import lines
from retarget_bench.figures.data import model as data
from retarget_bench.figures.plotting import canvas, drawing
from retarget_bench.results import result_matrix
from tests.engine.stored import header
from tests.in_process import without_processes

EPSILONS = ("0.05", "0.1", "1", "4")


def score(label: str, values: dict[str, list[float]], *, control: bool = False, sees=()) -> MethodSummary:
    """A method whose curves are these."""
    curves = {
        value: {
            e: Mean(number, 20, 12, Interval(number - 0.05, number + 0.05))
            for e, number in zip(EPSILONS, numbers, strict=True)
        }
        for value, numbers in values.items()
    }
    about = header(label, [], "cross", control=control, privileged=sees)
    return MethodSummary(label, about, {}, curves, None)


def both(recalls: list[float], precisions: list[float]) -> dict[str, list[float]]:
    return {"pan_recall": recalls, "pan_contact_precision": precisions}


@pytest.fixture
def sections() -> list[SplitSummary]:
    scores = [
        score("frozen", both([1.0] * 4, [0.2, 0.3, 0.6, 0.9]), control=True),
        score("pan+footfix", both([0.4, 0.5, 0.7, 0.9], [0.9, 0.9, 0.95, 0.97])),
        score("told", both([0.9, 0.92, 0.95, 0.99], [0.8, 0.9, 0.9, 0.9]), sees=("reference",)),
    ]
    return [
        SplitSummary("bows", split, (), np.zeros(0, dtype=bool), (), {}, scores=tuple(scores))
        for split in ("intra", "cross")
    ]


def drawn(path: Path, sections: list[SplitSummary]) -> None:
    """The curves of these summaries as a file."""
    charts = [
        data.LineChart(
            section.split, f"{section.split}: {section.clip_count} clips",
            data.Axis("step", 0.04, 5, log=True), data.Axis(f"{name} of foot contacts", -0.02, 1.02),
            tuple(
                data.Line(
                    each.label, each.label,
                    tuple(
                        data.Mark(each.label, float(e), mean, data.Cases(section.split))
                        for e, mean in each.curves[value].items()
                    ),
                )
                for each in section.scores
            ),
        )
        for value, name in lines.CONTACTS.items()
        for section in sections
    ]  # fmt: skip
    methods = {each.label: each.header for each in sections[0].scores}
    drawing.draw(path, data.Figure("recall", "bows", "contacts", methods, tuple(charts)))


def test_controls_are_dashed_and_methods_that_see_more_dotted(tmp_path, sections, figures):
    drawn(tmp_path / "out.png", sections)
    styles = {line.get_label(): line.get_linestyle() for line in figures[0].axes[0].lines}
    assert styles == {"frozen": "--", "pan+footfix": "-", "told": ":"}


def named(axes) -> list[str]:
    """The names at the ends of lines, from above."""
    box = {text.get_text(): Text.get_window_extent(text) for text in axes.texts}
    ordered = sorted(box, key=lambda name: -box[name].y0)
    assert all(box[above].y0 > box[below].y1 - 1 for above, below in pairwise(ordered))
    assert all(each.x0 > axes.bbox.x1 for each in box.values())
    return ordered


def test_lines_are_named_at_their_ends_where_there_is_room(tmp_path, sections, figures):
    drawn(tmp_path / "out.png", sections)
    figures[0].draw_without_rendering()  # so that extents are of one resolution
    assert not figures[0].legends
    ends = [named(axes) for axes in figures[0].axes]
    assert ends == [[], ["frozen", "told", "pan+footfix"], [], ["pan+footfix", "told", "frozen"]]


@pytest.mark.parametrize(("label", "more"), [("x" * 60, 1), ("m", 30)])
def test_more_or_longer_names_are_a_legend_in_the_order_of_the_lines(
    tmp_path, sections, figures, label, more
):
    values = both([0.4, 0.5, 0.7, 0.9], [0.9, 0.9, 0.95, 0.97])
    first, *others = sections[0].scores
    added = [score(f"{label}{k}", values) for k in range(more)]
    sections[0] = replace(sections[0], scores=(first, *added, *others))
    drawn(tmp_path / "out.png", sections)
    (legend,) = figures[0].legends
    labels = [canvas.drawable(each.label) for each in sections[0].scores]
    assert [text.get_text() for text in legend.get_texts()] == labels
    assert not any(axes.texts for axes in figures[0].axes)


@given(
    st.lists(st.floats(0, 100), min_size=1, max_size=12),
    st.floats(0, 12),
)
def test_names_keep_apart_in_the_order_of_the_ends_and_move_no_more_than_they_must(places, gap):
    placed = lines.apart(places, gap, 0.0, 100.0)
    if gap * (len(places) - 1) > 100:
        assert placed is None
        return
    assert placed is not None
    upwards = sorted(range(len(places)), key=lambda k: places[k])
    ordered = [placed[k] for k in upwards]
    assert all(b - a >= gap - 1e-9 for a, b in pairwise(ordered))
    assert ordered[0] >= -1e-9
    assert ordered[-1] <= 100 + 1e-9
    goals = [places[k] for k in upwards]
    if all(b - a >= gap for a, b in pairwise(goals)):
        assert ordered == pytest.approx(goals)
    # a general solver moves them no less
    count = len(places)
    solved = optimize.minimize(
        lambda at: np.sum((at - goals) ** 2), np.linspace(0, 100, count), jac=lambda at: 2 * (at - goals),
        bounds=[(0, 100)] * count, method="SLSQP",
        constraints={"type": "ineq", "fun": lambda at: np.diff(at) - gap} if count > 1 else (),
    )  # fmt: skip
    assert np.sum((np.array(ordered) - goals) ** 2) <= solved.fun + 1e-4 * max(1.0, solved.fun)


def test_bands_are_left_out_where_intervals_are_withheld(tmp_path, sections, figures):
    bare = sections[0].scores[1].curves["pan_recall"]
    bare["1"] = Mean(bare["1"].value, 3, 2)
    drawn(tmp_path / "out.png", sections[:1])
    assert [len(panel.collections) for panel in figures[0].axes] == [2, 3]


@pytest.mark.parametrize(
    "form",
    [
        pytest.param(form, marks=() if form == ".svg" else pytest.mark.slow)
        for form in sorted(canvas.ENDINGS)
    ],
)
def test_the_same_picture_is_the_same_file(tmp_path, sections, form):
    first, second = (tmp_path / f"{name}{form}" for name in "ab")
    for path in (first, second):
        drawn(path, sections)
    magic = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}[form]
    assert first.read_bytes().startswith(magic)
    assert first.read_bytes() == second.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"a{form}", f"b{form}"]


def test_results_without_the_curves_are_told(runs):
    (one,) = result_matrix.result_matrices(summary_places(runs))
    with pytest.raises(BenchError, match="no pan_recall_h, which the metric pan_contact gives"):
        lines.recall([one.narrowed("pan_recall")], by_height=True)


# -------------------------------------------------------------------------------------------- the command


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> Path:
    """Results of three methods on the smallest embedded data, one of them with a post-processor."""
    root = tmp_path_factory.mktemp("plots") / "runs"
    with without_processes(), pytest.raises(SystemExit) as stop:
        cli.main(
            "run copy_rotations copy_rotations+footfix[steps=2] rest_pose -s intra -d puppets[size=tiny] "
            f"--metrics pan_contact -j 1 --out {root}".split()
        )
    assert not stop.value.code
    return root


def test_what_is_drawn_is_what_tables_say(runs, tmp_path, bench, figures):
    output = tmp_path / "recall.svg"
    assert bench("plot", "recall", "-r", str(runs), "-o", str(output), "--columns", "pan_recall_h")[0] == 0
    section, *_ = summary.split_summaries(summary_places(runs), select=Selection())
    assert section.bodies == "people"
    lines = {line.get_label(): line for line in figures[0].axes[0].lines}
    assert set(lines) == {"copy_rotations", "copy_rotations+footfix[steps=2]", "rest_pose"}
    for each in section.scores:
        expected = [mean.value for _, mean in sorted(each.curves["pan_recall_h"].items())]
        assert sorted(lines[each.label].get_ydata()) == pytest.approx(sorted(expected))
    assert np.allclose(lines["rest_pose"].get_ydata(), 1.0)


def summary_places(root: Path):
    from retarget_bench.results import store

    return store.find_results(root)
