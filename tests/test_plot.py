"""Pictures of results: what is drawn is what the rows say, and what cannot be drawn is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from retarget_bench import cli
from retarget_bench.analysis import summary
from retarget_bench.analysis.selection import Selection
from retarget_bench.analysis.statistics import Interval
from retarget_bench.analysis.summary import Mean, MethodSummary, SplitSummary
from retarget_bench.errors import BenchError
from retarget_bench.figures import method_order, palette
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


def drawn(path: Path, sections: list[SplitSummary], width: float = 6.75) -> None:
    """The curves of these summaries as a file."""
    charts = [
        data.Chart(
            section.split, f"{section.split}: {section.clip_count} clips",
            data.Axis("step", 0.04, 5, log=True), data.Axis(f"{name} of foot contacts", -0.02, 1.02),
            tuple(
                data.Series(
                    each.label, each.label,
                    tuple(
                        data.Mark(float(e), mean, data.Cases(section.split))
                        for e, mean in each.curves[value].items()
                    ),
                    each.unranked,
                )
                for each in section.scores
            ),
            joined=True,
        )
        for value, name in lines.CONTACTS.items()
        for section in sections
    ]  # fmt: skip
    ranked = {each.label: each.header for each in sections[0].scores}
    figure = data.Figure("recall", "bows", "contacts", tuple(charts))
    drawing.draw(path, figure, method_order.styles(ranked, ["frozen"]), width)


def curves(axes) -> dict[str, object]:
    """The lines of a panel by their colours, without their marks and whiskers."""
    return {line.get_color(): line for line in axes.lines if len(line.get_xdata()) == len(EPSILONS)
            and line.get_linestyle() != "None"}  # fmt: skip


def test_controls_are_grey_and_dashed_and_methods_that_see_more_dotted(tmp_path, sections, figures):
    drawn(tmp_path / "out.png", sections)
    styles = [(color, line.get_linestyle()) for color, line in curves(figures[0].axes[0]).items()]
    assert styles == [
        (palette.CONTROLS[0], "--"), (palette.COLOURS[0], "-"), (palette.COLOURS[1], ":"),
    ]  # fmt: skip


def test_a_legend_names_all_lines_and_why_some_are_not_ranked(tmp_path, sections, figures):
    more = [score(f"m{k}", both([0.4] * 4, [0.9] * 4)) for k in range(20)]
    long = score("x" * 80, both([0.5] * 4, [0.9] * 4))
    sections[0] = replace(sections[0], scores=(*sections[0].scores, *more, long))
    drawn(tmp_path / "out.png", sections[:1], 3.25)
    figures[0].draw_without_rendering()  # so that extents are of one resolution
    (legend,) = figures[0].legends
    expected = [
        f"{each.label} ({each.unranked})" if each.unranked else each.label for each in sections[0].scores
    ]
    words = [text.get_text().replace("\n", "") for text in legend.get_texts()]
    assert words == list(map(canvas.drawable, expected))
    assert legend.get_texts()[0].get_text() == "frozen (control)"
    hollow = [each.get_markerfacecolor() == "white" for each in legend.legend_handles]
    assert hollow[:4] == [True, False, True, False]
    box, page = legend.get_window_extent(), figures[0].bbox
    assert box.y1 <= min(axes.get_tightbbox().y0 for axes in figures[0].axes) + 1
    assert box.width <= page.width


def test_intervals_are_whiskers_side_by_side_and_left_out_where_they_are_withheld(
    tmp_path, sections, figures
):
    bare = sections[0].scores[1].curves["pan_recall"]
    bare["1"] = Mean(bare["1"].value, 3, 2)
    drawn(tmp_path / "out.png", sections[:1])
    axes = figures[0].axes[0]
    assert not axes.collections  # no bands over each other
    whiskers = [line for line in axes.lines if np.isnan(np.array(line.get_ydata(), dtype=float)).any()]
    assert [len(line.get_xdata()) for line in whiskers] == [12, 9, 12]
    first = [line.get_transform().transform((0.1, 0.5))[0] for line in whiskers]
    assert first == sorted(set(first))
    low, high, gap = whiskers[0].get_ydata()[:3]
    assert (low, high) == pytest.approx((0.95, 1.05))
    assert np.isnan(gap)


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
        lines.recall([one.narrowed("pan_recall")], {}, by_height=True)


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
    drawn = [line.get_ydata() for line in figures[0].axes[0].lines if line.get_marker() not in ("None", "")]
    shown = [each for each in section.scores if each.label != "rest_pose"]  # controls are not asked for
    labels = [text.get_text() for text in figures[0].legends[0].get_texts()]
    assert labels == ["copy_rotations", "copy_rotations+footfix[steps=2]"]
    for line, label in zip(drawn, labels, strict=True):
        (score,) = (each for each in shown if each.label == label)
        expected = [mean.value for _, mean in sorted(score.curves["pan_recall_h"].items())]
        assert sorted(line) == pytest.approx(sorted(expected))


def summary_places(root: Path):
    from retarget_bench.results import store

    return store.find_results(root)
