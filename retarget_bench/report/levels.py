"""Errors of derived tasks over their levels: noise, and the share of joints that is given."""

from __future__ import annotations

from markupsafe import Markup

from retarget_bench.analysis.summary import Mean
from retarget_bench.evaluation.tasks import levels
from retarget_bench.figures.axis_limits import top
from retarget_bench.report import charts
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.charts import Frame, Scale
from retarget_bench.report.curves import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH
from retarget_bench.report.means import grouped, means, told
from retarget_bench.report.pictures import Looks, Picture, by_split

BEFORE, AFTER = "given_cm", "restored_cm"
ROOM = 1.25
"""How much higher than the noise itself the chart of denoising goes."""

Line = list[tuple[float, str, Mean]]
"""Place, level, mean."""


def denoise(chapter: Chapter, looks: Looks) -> Picture | None:
    """The error after denoising over the error before."""
    if chapter.kind != "denoise":
        return None
    found = []
    for split in chapter.splits:
        given = _given(split)
        if not given or split.main.id != AFTER:
            continue
        most = max(*given.values(), 1e-3)
        frame = Frame(
            Scale(0.0, most * 1.04, LEFT, RIGHT),
            Scale(0.0, most * ROOM, BOTTOM, TOP),
            "error of what was given, cm",
            "error of the answer, cm",
            split.name,
        )
        nothing = charts.tag(
            "line",
            x1=frame.x(0.0), y1=frame.y(0.0), x2=frame.x(most), y2=frame.y(most), class_="diagonal",
        )  # fmt: skip
        found.append(("", [_chart(split, given, frame, looks, nothing)]))
    return Picture(
        "denoise",
        "Error after denoising, over the error before",
        "The dotted diagonal is giving the noisy motion back. Flatter is better; what stands at the upper "
        "edge is far worse than doing nothing.",
        by_split(found),
    )


def upsample(chapter: Chapter, looks: Looks) -> Picture | None:
    """The error over the share of joints that was given."""
    if chapter.kind != "upsample":
        return None
    found = []
    for split in chapter.splits:
        by_level = grouped(split, "level") if "level" in split.groups else {}
        places = {name: at for name in by_level if (at := levels.number(name)) is not None}
        if not places:
            continue
        rows = zip(*(by_level[name] for name in places), strict=True)
        highest = top([max((m.value for m in row if m is not None), default=float("nan")) for row in rows])
        frame = Frame(
            Scale(0.0, 100.0, LEFT, RIGHT),
            Scale(0.0, highest * 1.05, BOTTOM, TOP),
            "joints given, %",
            f"{split.main.label}, {split.main.unit}",
            split.name,
        )
        found.append(("", [_chart(split, places, frame, looks)]))
    return Picture(
        "upsample",
        "Error over the share of joints that was given",
        "Lower is better. What stands at the upper edge is far worse than most.",
        by_split(found),
    )


def _given(split: Split) -> dict[str, float]:
    """Level -> mean error of the sources, of the method that answered most cases."""
    if (BEFORE, "") not in split.panel.keys or "level" not in split.groups:
        return {}
    numbers = split.panel.numbers((BEFORE, ""))
    found = {}
    for name in dict.fromkeys(split.groups["level"]):
        here = [each == name for each in split.groups["level"]]
        known = [mean for mean in means(numbers[:, here], split.panel.clips[here]) if mean is not None]
        if known:
            found[name] = max(known, key=lambda mean: mean.n).value
    return found


def _chart(split: Split, places: dict[str, float], frame: Frame, looks: Looks, *under: Markup) -> Markup:
    by_level = grouped(split, "level")
    parts: list[Markup] = list(under)
    marks = []
    said = []
    for row, label in enumerate(split.labels):
        line: Line = sorted(
            (places[name], name, mean) for name in places if (mean := by_level[name][row]) is not None
        )
        if not line:
            continue
        said.append(f"{label} {line[-1][2].value:.3g}")
        parts.append(
            charts.line([(frame.x(at), frame.y(mean.value)) for at, _, mean in line], looks[label])
        )
        for at, name, mean in line:
            marks.append(
                charts.pick(
                    f"{label}, {name}: {told(mean, split.digits, split.main.unit)}",
                    charts.mark(frame.x(at), frame.y(mean.value), looks[label]),
                    split=split.name,
                    value=split.main.id,
                    method=label,
                    level=name,
                )
            )
    alternative = (
        f"{frame.title}. {frame.label_y} over {frame.label_x}; at the right end: {', '.join(said)}"
    )
    return charts.svg(WIDTH, HEIGHT, alternative, frame.drawn(), *parts, *marks)
