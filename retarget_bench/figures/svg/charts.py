"""Drawing a chart as inline SVG."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from retarget_bench.analysis.summary import Mean
from retarget_bench.figures.data.lines import apart
from retarget_bench.figures.data.model import (
    BoxChart,
    Chart,
    HeatMap,
    Line,
    LineChart,
    Mark,
    PointChart,
    RowChart,
    SkeletonChart,
)  # fmt: skip
from retarget_bench.figures.data.rows import lift
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.figures.svg import elements
from retarget_bench.figures.svg.elements import Scale, tag, words
from retarget_bench.tables.model import count

WIDTH, HEIGHT = 360.0, 240.0
LEFT, RIGHT, BOTTOM, TOP = 46.0, 350.0, 200.0, 24.0
"""Of charts of lines."""
NAME_GAP = 11.5
"""Between names at the ends of lines."""
ROW_WIDTH, NAMES, ROW, ABOVE, BELOW = 460.0, 140.0, 23.0, 24.0, 40.0
POINT_HEIGHT = 300.0
APART = 9
"""With so many rows every method has a line of its own in each."""
SQUARE, MAP_NAMES = 30.0, 74.0
BODY_WIDTH, BODY_HEIGHT, BODY_ABOVE = 150.0, 206.0, 32.0
TITLE = 21
"""Letters of a line above a body."""
LEAST, MOST = 2.6, 7.5
"""Radii of joints without and with the largest error."""
EDGE = "M-4-4L4 0L-4 4Z"
CLIP = "M0-2.6A2.6 2.6 0 1 1 0 2.6A2.6 2.6 0 1 1 0-2.6Z"


@dataclass(frozen=True)
class Drawing:
    """Draws charts for a page. styles: of the methods. decimals: value id -> those of its table.
    units: value id -> its unit."""

    styles: Mapping[str, MethodStyle]
    decimals: Mapping[str, int]
    units: Mapping[str, str]

    def chart(self, chart: Chart) -> Markup:
        """The chart, with a sentence of what it shows."""
        match chart:
            case LineChart():
                return self._lines(chart)
            case RowChart():
                return self._rows(chart)
            case PointChart():
                return self._points(chart)
            case BoxChart():
                return self._boxes(chart)
            case HeatMap():
                return self._map(chart)
            case SkeletonChart():
                return self._skeleton(chart)

    def _pick(self, mark: Mark, what: str, *children: Markup) -> Markup:
        """A mark that leads to its cases."""
        cases = mark.cases
        data = {"split": cases.split, "method": mark.method}
        if cases.part is not None:
            data[cases.part[0]] = cases.part[1]
        if cases.worst is not None:
            data |= {"worst": " ".join(f"{case}:{number:.4g}" for case, number in cases.worst)}
            data |= {"what": cases.what}
        if cases.value:
            data["value"] = cases.value
        return elements.pick(f"{what}: {self._mean_text(mark.mean, cases.value)}", *children, **data)

    def _mean_text(self, mean: Mean, value: str) -> str:
        """A mean in words."""
        decimals, unit = self.decimals.get(value, 3), self.units.get(value, "")
        text = f"{mean.value:.{decimals}f}" + (f" {unit}" if unit else "")
        if mean.interval is not None:
            text += f", interval {mean.interval.low:.{decimals}f} to {mean.interval.high:.{decimals}f}"
        return text if mean.n == 1 else f"{text}, {count(mean.n, 'case')} of {count(mean.clips, 'clip')}"

    # -------------------------------------------------------------------------------------------- lines
    def _lines(self, chart: LineChart) -> Markup:
        x, y = Scale.of(chart.x, LEFT, RIGHT), Scale.of(chart.y, BOTTOM, TOP)
        parts = [elements.axes(chart.x, chart.y, x, y, chart.title)]
        if chart.diagonal:
            end = min(chart.x.high / 1.02, chart.y.high)
            parts.append(elements.grid_line(x(0.0), y(0.0), x(end), y(end), "diagonal"))
        strokes, marks = [], []
        for line in chart.lines:
            style = self.styles[line.method]
            spans = [(x(m.at), m.mean.interval) for m in line.marks if m.mean.interval is not None]
            if line.banded and line.marks:
                low = [(at, y(span.low)) for at, span in spans]
                parts.append(elements.band(low, [(at, y(span.high)) for at, span in spans], style))
            if line.marks:
                path = [(x(mark.at), y(mark.mean.value)) for mark in line.marks]
                strokes.append(elements.line(path, style, "dashed" if line.seen is False else ""))
            for mark in (*line.marks, *line.extra):
                shape = elements.mark(
                    x(mark.at), y(mark.mean.value), style, 1.3 if mark in line.extra else 0.75,
                    hollow=mark in line.extra or line.seen is False,
                )  # fmt: skip
                marks.append(self._pick(mark, f"{line.name}, {mark.name}", shape))
        names, wide = self._end_names([line for line in chart.lines if line.marks], x, y)
        ends = ", ".join(
            f"{line.name} {line.marks[-1].mean.value:.3g}" for line in chart.lines if line.marks
        )
        label = f"{chart.title}. {chart.y.label} over {chart.x.label}; at the right end: {ends}"
        return elements.svg(WIDTH + wide, HEIGHT, label, *parts, *names, *strokes, *marks)

    def _end_names(self, lines: Sequence[Line], x: Scale, y: Scale) -> tuple[list[Markup], float]:
        """The names of lines at their ends, and the units that they take at the right; none where lines are
        too many, since the page has a legend, too."""
        ends = [(x(line.marks[-1].at), y(line.marks[-1].mean.value)) for line in lines]
        heights = apart([height for _, height in ends], NAME_GAP, TOP, BOTTOM)
        if not lines or heights is None:
            return [], 0.0
        names = [elements.short(line.name, elements.LONGEST) for line in lines]
        parts = []
        for line, name, (at, end), height in zip(lines, names, ends, heights, strict=True):
            style = self.styles[line.method]
            parts.append(elements.grid_line(at, end, RIGHT + 12, height, f"leader {style.name}"))
            parts.append(elements.mark(RIGHT + 12, height, style, 0.7, hollow=line.seen is False))
            parts.append(words(RIGHT + 18, height + 3.5, name, "start", class_="name", aria_hidden="true"))
        return parts, elements.LETTER * max(map(len, names)) + 8

    # --------------------------------------------------------------------------------------------- rows
    def _rows(self, chart: RowChart) -> Markup:
        apart = len(chart.rows) <= APART and not chart.together
        row = max(24.0, 7.0 * len(chart.marks) + 8) if apart else ROW
        height = ABOVE + row * len(chart.rows) + BELOW
        x = Scale.of(chart.axis, NAMES, ROW_WIDTH - 12)
        parts = [
            elements.row_axis(chart.axis, x, height - BELOW, ABOVE, chart.rows, chart.title, 8.0),
            *(
                elements.grid_line(4.0, ABOVE + row * k, ROW_WIDTH - 12, ABOVE + row * k, "rule")
                for k in range(1, len(chart.rows))
            ),
        ]
        for place, (label, marks) in enumerate(chart.marks.items()):
            share = (place + 1) / (len(chart.marks) + 1) if apart else 0.5
            parts += [self._row_mark(mark, label, x, ABOVE + row * (mark.at + share)) for mark in marks]
        lowest = []
        for k, name in enumerate(chart.rows):
            numbers = [(m.mean.value, m.method) for each in chart.marks.values() for m in each if m.at == k]
            lowest += [f"{name} {min(numbers)[1]}"] if numbers else []
        label = f"{chart.title}: {chart.axis.label}; lowest: {', '.join(lowest)}"
        return elements.svg(ROW_WIDTH, height, label, *parts)

    def _row_mark(self, mark: Mark, label: str, x: Scale, y: float) -> Markup:
        style, parts = self.styles[label], []
        if (span := mark.mean.interval) is not None:
            parts.append(elements.grid_line(x(span.low), y, x(span.high), y, f"whisker {style.name}"))
        parts.append(elements.mark(x(mark.mean.value), y, style, 0.8, hollow=mark.hollow))
        return self._pick(mark, f"{label}, {mark.name}", *parts)

    # -------------------------------------------------------------------------------------------- boxes
    def _boxes(self, chart: BoxChart) -> Markup:
        height = ABOVE + ROW * len(chart.boxes) + BELOW
        x = Scale.of(chart.axis, NAMES, ROW_WIDTH - 12)
        names = [box.method for box in chart.boxes]
        parts = [elements.row_axis(chart.axis, x, height - BELOW, ABOVE, names, chart.title, 18.0)]
        for row, box in enumerate(chart.boxes):
            y, style = ABOVE + ROW * (row + 0.5), self.styles[box.method]
            at = [x(each) for each in box.quantiles]
            parts += [
                elements.mark(NAMES - 9, y, style),
                tag(
                    "g",
                    elements.grid_line(at[0], y, at[4], y),
                    tag("rect", x=at[1], y=y - 7, width=max(1.0, at[3] - at[1]), height=14, rx=2),
                    elements.grid_line(at[2], y - 7, at[2], y + 7, "median"),
                    class_=f"box {style.name}",
                ),
            ]
            for mark in box.marks:
                beyond = chart.axis.beyond(mark)
                place = (
                    f"translate({x(mark.mean.value):.1f} {y + (0.0 if beyond else ROW * lift(mark)):.1f})"
                )
                dot = tag("path", d=EDGE if beyond else CLIP, transform=place, class_=f"clip {style.name}")
                parts.append(self._pick(mark, f"{box.method}, clip {mark.name}", dot))
        medians = ", ".join(f"{box.method} {box.quantiles[2]:.3g}" for box in chart.boxes)
        return elements.svg(
            ROW_WIDTH, height, f"{chart.title}: {chart.axis.label}; medians: {medians}", *parts
        )

    # ------------------------------------------------------------------------------------------- points
    def _points(self, chart: PointChart) -> Markup:
        x = Scale.of(chart.x, LEFT, ROW_WIDTH - 12)
        y = Scale.of(chart.y, POINT_HEIGHT - BELOW, ABOVE)
        front = [(x(mark.at), y(mark.mean.value)) for mark in chart.front]
        steps = [
            (at, height)
            for k, (_, height) in enumerate(front)
            for at in (front[max(0, k - 1)][0], front[k][0])
        ]
        path = "M" + "L".join(f"{across:.1f} {up:.1f}" for across, up in steps)
        parts = [elements.axes(chart.x, chart.y, x, y, chart.title)]
        parts += [tag("path", d=path, class_="front")] if front else []
        for mark in chart.marks:
            at, height = x(mark.at), y(mark.mean.value)
            style = self.styles[mark.method]
            shape = elements.mark(at, height, style, 1.3, hollow=mark.hollow)
            if (span := mark.mean.interval) is not None:
                shape = (
                    elements.grid_line(at, y(span.low), at, y(span.high), f"whisker {style.name}") + shape
                )
            parts.append(self._pick(mark, f"{mark.method}: {mark.at:.3g} frames per second", shape))
        places = [(x(mark.at), y(mark.mean.value)) for mark in chart.marks]
        names = [elements.short(mark.method, elements.LONGEST) for mark in chart.marks]
        room = LEFT, ABOVE - 7, ROW_WIDTH, POINT_HEIGHT - BELOW + 2
        spans = [(x(mark.at), span) for mark in chart.marks if (span := mark.mean.interval) is not None]
        whiskers = [(at, y(span.high), y(span.low)) for at, span in spans]
        parts += elements.names_beside(places, names, room, whiskers)
        points = ", ".join(
            f"{mark.method} {mark.at:.3g} frames per second and {mark.mean.value:.3g}"
            for mark in chart.marks
        )
        return elements.svg(
            ROW_WIDTH, POINT_HEIGHT, f"{chart.title}: {chart.y.label}, and speed: {points}", *parts
        )

    # ------------------------------------------------------------------------------------------- bodies
    def _map(self, chart: HeatMap) -> Markup:
        parts = []
        title, lines = elements.heading(chart.method, 28)
        above = 17.0 + 13.0 * lines + 5.4 * min(12, max(map(len, chart.targets)))
        for column, name in enumerate(chart.targets):
            turn = f"translate({MAP_NAMES + SQUARE * (column + 0.62):.1f} {above - 5:.1f}) rotate(-55)"
            parts.append(words(0.0, 0.0, elements.short(name, 12), "start", transform=turn))
        for row, name in enumerate(chart.sources):
            y = above + SQUARE * (row + 0.62)
            parts.append(words(MAP_NAMES - 6, y, elements.short(name, 12), "end"))
        squares = [
            self._square(
                mark, chart.scale.share(mark.mean.value),
                MAP_NAMES + SQUARE * chart.targets.index(target),
                above + SQUARE * chart.sources.index(source),
            )
            for (source, target), mark in chart.squares.items()
        ]  # fmt: skip
        far = max(chart.squares.values(), key=lambda mark: mark.mean.value)
        return elements.svg(
            MAP_NAMES + SQUARE * len(chart.targets) + 24,
            above + SQUARE * len(chart.sources) + 4,
            f"{chart.method} by pair: highest {far.name}, {far.mean.value:.3g}",
            title,
            tag("g", *parts, class_="axes", aria_hidden="true"),
            *squares,
        )

    def _square(self, mark: Mark, share: float, x: float, y: float) -> Markup:
        shade, number = elements.shade(share), mark.mean.value
        digits = f"{number:.0f}" if abs(number) >= 9.95 else f"{number:.1f}"
        side = SQUARE - 1
        return self._pick(
            mark,
            f"{mark.method}, {mark.cases.split}, {mark.name}",
            tag("rect", x=x + 0.5, y=y + 0.5, width=side, height=side, rx=2, class_=f"heat {shade}"),
            words(x + SQUARE / 2, y + SQUARE / 2 + 3.5, digits, class_=f"on {shade}"),
        )

    def _skeleton(self, chart: SkeletonChart) -> Markup:
        places = _fitted(np.array(chart.places))
        bones = [elements.grid_line(*places[a], *places[b], "bone") for a, b in chart.bones]
        dots = []
        for mark in chart.marks:
            share, (x, y) = chart.scale.share(mark.mean.value), places[int(mark.at)]
            radius, shade = LEAST + (MOST - LEAST) * share, elements.shade(share)
            circle = tag("circle", cx=x, cy=y, r=radius, class_=f"joint {shade}")
            dots.append(self._pick(mark, f"{mark.method}, {mark.name}", circle))
        far = ", ".join(f"{mark.name} {mark.mean.value:.3g}" for mark in chart.marks[:-4:-1])
        title, _ = elements.heading(chart.method, TITLE)
        label = f"{chart.method}: farthest off are {far}; {chart.scale.label}"
        return elements.svg(BODY_WIDTH, BODY_HEIGHT, label, title, *bones, *dots)


def _fitted(places: np.ndarray) -> list[tuple[float, float]]:
    """Joints in the chart, from places right and up in metres."""
    flat = places * [1.0, -1.0]
    low, high = flat.min(axis=0), flat.max(axis=0)
    room = np.array([BODY_WIDTH - 22, BODY_HEIGHT - BODY_ABOVE - 18])
    scale = float((room / np.maximum(high - low, 1e-6)).min())
    middle = np.array([BODY_WIDTH / 2, BODY_ABOVE + (BODY_HEIGHT - BODY_ABOVE) / 2])
    return [(float(x), float(y)) for x, y in (flat - (low + high) / 2) * scale + middle]
