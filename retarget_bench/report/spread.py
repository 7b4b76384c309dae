"""How the main value is spread: over clips, over kinds of performance, and against speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from retarget_bench.analysis import statistics
from retarget_bench.analysis.summary import Mean
from retarget_bench.figures.axis_limits import top
from retarget_bench.report import charts
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.charts import ChartStyle, Frame, Scale
from retarget_bench.report.means import finite, grouped, told
from retarget_bench.report.pictures import Looks, Picture, by_split

WIDTH, NAMES, LINE, ABOVE, BELOW = 460.0, 140.0, 23.0, 24.0, 40.0
LONGEST = 19
"""Letters of a label that fit beside a chart."""
DOTS = 60
"""With more clips only those outside the whiskers are drawn."""
KINDS = 30
"""Kinds that are drawn, the hardest."""
APART = 9
"""With so many kinds every method has a line of its own."""
SPEED_WIDTH, SPEED_HEIGHT = 460.0, 300.0


def _picture(name: str, title: str, reading: str, drawn: Sequence[Markup]) -> Picture:
    """A chart per split, where there is one."""
    return Picture(name, title, reading, by_split([("", [each for each in drawn if each])]))


# ---------------------------------------------------------------------------------------------- clips
def clips(chapter: Chapter, looks: Looks) -> Picture:
    """A box and dots per method: every dot a source clip."""
    return _picture(
        "clips",
        "Distribution over clips",
        "Every dot is a source clip, its cases averaged. Boxes hold the middle half of the clips, the line "
        "in them is the median, whiskers reach from 5 to 95 %. Arrowheads at the edge are clips far beyond "
        "it.",
        [_boxes(split, looks) for split in chapter.splits],
    )


def _boxes(split: Split, looks: Looks) -> Markup:
    per_clip = statistics.per_clip(split.numbers, split.panel.clips)
    rows = [row for row in range(len(per_clip)) if finite(per_clip[row])]
    if not rows:
        return Markup()
    names = list(dict.fromkeys(split.groups["clip"]))
    upper = top([float(np.nanquantile(per_clip[row], 0.97)) for row in rows], split.digits)
    lower = min(0.0, min(float(np.nanmin(per_clip[row])) for row in rows))
    height = ABOVE + LINE * len(rows) + BELOW
    frame = Frame(
        Scale(lower, upper, NAMES, WIDTH - 12),
        Scale(0.0, 1.0, height - BELOW, ABOVE),
        _heading(split),
        title=split.name,
    )
    parts = [_rows_axis(frame, [split.labels[row] for row in rows], looks)]
    for line, row in enumerate(rows):
        y = ABOVE + LINE * (line + 0.5)
        parts += _row(split, row, per_clip[row], names, y, frame, looks[split.labels[row]])
    medians = ", ".join(f"{split.labels[row]} {np.nanmedian(per_clip[row]):.3g}" for row in rows)
    return charts.svg(WIDTH, height, f"{split.name}: {frame.label_x}; medians: {medians}", *parts)


def _rows_axis(frame: Frame, names: list[str], looks: Looks | None) -> Markup:
    """Vertical grid, and names of the rows at the left."""
    low, high = frame.y.start, frame.y.end
    parts = []
    for each in frame.x.ticks():
        at = frame.x(each)
        parts.append(charts.tag("line", x1=at, y1=low, x2=at, y2=high))
        parts.append(charts.words(at, low + 14, f"{each:g}"))
    parts.append(charts.words((frame.x.start + frame.x.end) / 2, low + 30, frame.label_x, class_="label"))
    parts.append(charts.words(2.0, 14.0, frame.title, "start", class_="title"))
    marks = []
    step = (low - high) / max(1, len(names))
    for line, name in enumerate(names):
        y = high + step * (line + 0.5)
        parts.append(
            charts.words(NAMES - (18.0 if looks else 8.0), y + 3.5, charts.short(name, LONGEST), "end")
        )
        if looks:
            marks.append(charts.mark(NAMES - 9, y, looks[name]))
    return charts.tag("g", charts.tag("g", *parts, class_="axes"), *marks, aria_hidden="true")


def _row(
    split: Split, row: int, numbers: np.ndarray, names: list[str], y: float, frame: Frame, look: ChartStyle
) -> list[Markup]:
    there = numbers[~np.isnan(numbers)]
    q = [float(each) for each in np.quantile(there, (0.05, 0.25, 0.5, 0.75, 0.95))]
    at = [frame.x(each) for each in q]
    box = charts.tag(
        "g",
        charts.tag("line", x1=at[0], y1=y, x2=at[4], y2=y),
        charts.tag("rect", x=at[1], y=y - 7, width=max(1.0, at[3] - at[1]), height=14, rx=2),
        charts.tag("line", x1=at[2], y1=y - 7, x2=at[2], y2=y + 7, class_="median"),
        class_=f"box {look.name}",
    )
    dots = []
    for clip, number in enumerate(numbers):
        if np.isnan(number) or (len(there) > DOTS and q[0] <= number <= q[4]):
            continue
        beyond = number > frame.x.high
        lift = 0.0 if beyond else ((clip * 0.618) % 1 - 0.5) * 11
        path = "M-4-4L4 0L-4 4Z" if beyond else "M0-2.6A2.6 2.6 0 1 1 0 2.6A2.6 2.6 0 1 1 0-2.6Z"
        dot = charts.tag(
            "path",
            d=path,
            transform=f"translate({frame.x(number):.1f} {y + lift:.1f})",
            class_=f"clip {look.name}",
        )
        words = f"{split.labels[row]}, clip {names[clip]}: {number:.{split.digits}f}"
        dots.append(
            charts.pick(
                words,
                dot,
                split=split.name,
                value=split.main.id,
                method=split.labels[row],
                clip=names[clip],
            )
        )
    return [box, *dots]


# ---------------------------------------------------------------------------------------------- kinds
def kinds(chapter: Chapter, looks: Looks) -> Picture:
    """A line per kind of performance, a dot with its interval per method."""
    return _picture(
        "kinds",
        "By kind of performance",
        "Means over clips, with intervals where there are clips enough. Methods that are not ranked "
        "are left out. What stands at the right edge is farther off.",
        [_kinds(split, looks) for split in chapter.splits],
    )


def _kinds(split: Split, looks: Looks) -> Markup:
    found = grouped(split, "kind")
    rows = [row for row in range(len(split.labels)) if split.ranked[row]] or list(range(len(split.labels)))
    rows = [row for row in rows if any(each[row] is not None for each in found.values())]
    if len(found) < 2 or not rows:
        return Markup()
    shown = sorted(found, key=lambda kind: -_hardness(found[kind], rows, split))[:KINDS]
    highest = [
        max(finite(mean.value for kind in shown if (mean := found[kind][row]) is not None)) for row in rows
    ]
    apart = len(shown) <= APART  # else all marks of a kind stand on one line
    line = max(24.0, 7.0 * len(rows) + 8) if apart else 19.0
    height = ABOVE + line * len(shown) + BELOW
    frame = Frame(
        Scale(0.0, top(highest, split.digits) * 1.05, NAMES, WIDTH - 12),
        Scale(0.0, 1.0, height - BELOW, ABOVE),
        _heading(split),
        title=f"{split.name}, hardest first"
        + (f" ({KINDS} of {len(found)})" if len(found) > KINDS else ""),
    )
    parts = [_rows_axis(frame, shown, None)]
    for k, kind in enumerate(shown):
        y = ABOVE + line * k
        if k:
            parts.append(charts.tag("line", x1=4.0, y1=y, x2=WIDTH - 12, y2=y, class_="rule"))
        for place, row in enumerate(rows):
            at = y + line * ((place + 1) / (len(rows) + 1) if apart else 0.5)
            parts.append(_kind(split, row, kind, found, at, frame, looks))
    best = ", ".join(
        f"{kind} {split.labels[min(known)[1]]}"
        for kind in shown
        if (known := [(mean.value, row) for row in rows if (mean := found[kind][row]) is not None])
    )
    return charts.svg(WIDTH, height, f"{split.name}: {frame.label_x} by kind; lowest: {best}", *parts)


def _hardness(means: Sequence[Mean | None], rows: Sequence[int], split: Split) -> float:
    """The mean over methods: the larger, the worse."""
    known = np.array([mean.value for row in rows if (mean := means[row]) is not None])
    loss = statistics.losses(known, split.main.better, split.main.goal)
    return float(loss.mean()) if len(loss) else -np.inf


def _kind(split: Split, row: int, kind: str, found: dict, y: float, frame: Frame, looks: Looks) -> Markup:
    mean = found[kind][row]
    if mean is None:
        return Markup()
    label = split.labels[row]
    parts = []
    if mean.interval is not None:
        ends = frame.x(mean.interval.low), frame.x(mean.interval.high)
        parts.append(
            charts.tag("line", x1=ends[0], y1=y, x2=ends[1], y2=y, class_=f"whisker {looks[label].name}")
        )
    parts.append(charts.mark(frame.x(mean.value), y, looks[label], 0.8))
    words = told(mean, split.digits, split.main.unit)
    return charts.pick(
        f"{label}, {kind}: {words}", *parts, split=split.name, value=split.main.id, method=label, kind=kind
    )


# ---------------------------------------------------------------------------------------------- speed
def speed(chapter: Chapter, looks: Looks) -> Picture:
    """The main value over frames per second, the methods that nothing beats in both joined by a line."""
    return _picture(
        "speed",
        "Quality against speed",
        "Frames per second of one process and one thread. The line joins the ranked methods that no "
        "other beats in both.",
        [_speed(split, looks) for split in chapter.splits],
    )


def _speed(split: Split, looks: Looks) -> Markup:
    main = split.main.id
    found = [
        (score.fps, score.means[main], score.label)
        for score in split.section.scores
        if score.fps and main in score.means and not score.header.method.control
    ]
    if len(found) < 2:
        return Markup()
    rates = [rate for rate, _, _ in found]
    frame = Frame(
        Scale(min(rates) / 1.5, max(rates) * 2.2, 46.0, SPEED_WIDTH - 12, log=True),
        Scale(
            0.0, top([mean.value for _, mean, _ in found], split.digits) * 1.08, SPEED_HEIGHT - BELOW, ABOVE
        ),
        "frames per second",
        f"{split.main.label}, {split.main.unit}",
        split.name,
    )
    ranked = {score.label for score in split.section.scores if not score.unranked}
    front = _front([each for each in found if each[2] in ranked], split.main.better)
    path = "M" + "L".join(f"{frame.x(rate):.1f} {frame.y(mean.value):.1f}" for rate, mean, _ in front)
    parts = [frame.drawn(), charts.tag("path", d=path, class_="front")]
    for rate, mean, label in found:
        words = told(mean, split.digits, split.main.unit)
        mark = charts.mark(frame.x(rate), frame.y(mean.value), looks[label], 1.3)
        parts.append(
            charts.pick(
                f"{label}: {rate:.3g} frames per second, {words}",
                mark,
                split=split.name,
                value=main,
                method=label,
            )
        )
    for rate, mean, label in front:
        at = frame.x(rate), frame.y(mean.value) - 9
        anchor = "end" if at[0] > 0.7 * SPEED_WIDTH else "start"
        parts.append(
            charts.words(
                at[0], at[1], charts.short(label, LONGEST), anchor, class_="name", aria_hidden="true"
            )
        )
    names = ", ".join(
        f"{label} {rate:.3g} frames per second and {mean.value:.3g}" for rate, mean, label in found
    )
    return charts.svg(
        SPEED_WIDTH, SPEED_HEIGHT, f"{split.name}: {frame.label_y}, and speed: {names}", *parts
    )


def _front(found: list, better: str) -> list:
    """Those that no other is both faster and better than, fastest first."""
    sign = -1.0 if better == "higher" else 1.0
    kept: list = []
    for each in sorted(found, key=lambda point: -point[0]):
        if not kept or sign * each[1].value < sign * kept[-1][1].value:
            kept.append(each)
    return kept


def _heading(split: Split) -> str:
    unit = f", {split.main.unit}" if split.main.unit != "1" else ""
    return f"{split.main.label}{unit} {split.main.arrow}".strip()
