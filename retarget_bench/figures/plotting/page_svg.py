"""Charts as inline SVG for a page: matplotlib draws them, text stays text, and marks lead to their cases.

What belongs to a method has the class of its style, so that a page can hide it. A mark is a ``pick``: with
the data attributes of its group and chart, a page's script finds the cases behind it.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from markupsafe import Markup, escape

from retarget_bench.errors import printable
from retarget_bench.figures.data.model import Chart, Mark, Series, SkeletonChart
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.figures.plotting import canvas, drawing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, SMALL = canvas.WIDTHS["column"], (1.3, 1.75)
"""Inches: of a chart, and width and height of a skeleton."""
TICKS, EDGE = 0.2, 0.1
"""Inches: of numbers below an axis with their gap, and left free at the sides."""
DROPPED = frozenset(["metadata", "style", "title"])
"""Elements of a file that mean nothing within a page."""
HREF = "{http://www.w3.org/1999/xlink}href"
KEPT = ("d", "x", "y", "width", "height", "transform", "clip-path", "href", "style")
OWN = frozenset(
    ["font", "font-family", "font-size", "stroke-linecap", "stroke-linejoin", "stroke-miterlimit"]
)
"""Properties that a page sets itself; of fonts it takes the size."""


@dataclass(frozen=True)
class _Group:
    """What an artist with a gid is on the page: classes, data attributes, and an element's attributes for
    each of its marks."""

    attributes: str
    marks: tuple[str, ...] = ()


def chart(data: Chart, styles: Mapping[str, MethodStyle], name: str, say: Callable[[Mark], str]) -> Markup:
    """A chart as an element. name: with which its ids begin. say: what a mark means, in words."""
    groups: dict[str, _Group] = {}
    for number, series in enumerate(data.series):
        style, label = styles[series.method], printable(series.title)
        own = _attributes(class_=style.name)
        groups |= {f"{number}-line": _Group(own), f"{number}-box": _Group(own)}
        for group, marks in series.groups(data.value).items():
            picks = tuple(_pick(mark, label, say) for mark in marks)
            leading = _attributes(class_=style.name, data_method=series.method)
            groups[f"{number}-{group}"] = _Group(leading, picks)
    with _figure(WIDTH, sum(_around(data)[1::2]) + drawing.body(data)) as (figure, written):
        left, top, right, bottom = _around(data)
        width, height = figure.get_size_inches()
        box = (left / width, bottom / height, 1 - (left + right) / width, 1 - (top + bottom) / height)
        drawing.panel(figure.add_axes(box), data, styles, WIDTH)
    value = next(mark.cases.value for each in data.series for mark in (*each.marks, *each.extra))
    label = f"{data.title}: {data.value.label}; {_ranges(data.series)}"
    return _svg(written, groups, name, label, "chart", data_split=data.split, data_value=value)


def skeleton(
    data: SkeletonChart, styles: Mapping[str, MethodStyle], name: str, say: Callable[[Mark], str]
) -> Markup:
    """A body as an element; the parameters as of ``chart``."""
    with _figure(*SMALL) as (figure, written):
        drawn = drawing.skeleton(figure, data)
    own = _attributes(data_method=data.method)
    groups = {
        gid: _Group(own, tuple(_pick(m, data.method, say) for m in marks)) for gid, marks in drawn.items()
    }
    far = ", ".join(f"{mark.name} {mark.mean.value:.3g}" for mark in data.marks[:-4:-1])
    label = f"{data.method}: farthest off are {far}; {data.errors.label}"
    kind = f"chart {styles[data.method].name}"
    return _svg(written, groups, name, label, kind, data_split=data.split, data_value="")


def sample(style: MethodStyle, unranked: str, name: str) -> Markup:
    """A line and a mark of a method, for a legend."""
    with _figure(0.45, 0.2) as (figure, written):
        line = drawing.sample(Series("", "", (), unranked), style, joined=True)
        line.set_data([0.05, 0.5, 0.95], [0.5, 0.5, 0.5])
        line.set(markevery=[1], transform=figure.transFigure)
        figure.add_artist(line)
    return _svg(written, {}, name, "", "sample")


# ---------------------------------------------------------------------------------------------- drawing
@contextmanager
def _figure(width: float, height: float) -> Iterator[tuple[Figure, io.BytesIO]]:
    """A figure of so many inches, and the SVG that it is written to when it is done."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    written = io.BytesIO()
    with canvas.styled():
        figure = Figure(figsize=(width, height), frameon=False)
        yield figure, written
        FigureCanvasSVG(figure).print_svg(written)  # type: ignore[no-untyped-call]


def _around(data: Chart) -> tuple[float, float, float, float]:
    """Inches that words take at the left, top, right and bottom of a chart."""
    names = [len(drawing.row_name(text, WIDTH)) for _, text in data.at.ticks] if data.rows else []
    below, title, second = (
        canvas.LINE * (canvas.wrapped(words, drawing.WORDS * WIDTH).count("\n") + 1) if words else 0.0
        for words in (data.x.label, data.title, data.above[0] if data.above else "")
    )
    slanted = canvas.LINE if data.x.log and data.x.ticks else 0.0
    top = EDGE + title + (TICKS + second if second else 0.0)
    return canvas.LETTER * max(names, default=8) + EDGE, top, 2 * EDGE, TICKS + slanted + below


def _ranges(series: Sequence[Series]) -> str:
    """Least and largest number of every method, in words."""
    numbers = {each.title: [mark.mean.value for mark in each.marks] for each in series if each.marks}
    return ", ".join(f"{name} {min(each):.3g} to {max(each):.3g}" for name, each in numbers.items())


# ---------------------------------------------------------------------------------------------- elements
def _attributes(**attributes: str) -> str:
    """``_`` in names of attributes is ``-``; all text is escaped."""
    return "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(printable(text))}"'
        for key, text in attributes.items()
    )


def _pick(mark: Mark, label: str, say: Callable[[Mark], str]) -> str:
    """The attributes of a mark that leads to its cases."""
    place = f"{label}, {mark.name}" if mark.name else label
    data = {} if mark.cases.part is None else {f"data_{mark.cases.part[0]}": mark.cases.part[1]}
    if mark.cases.worst is not None:
        worst = " ".join(f"{case}:{round(number, 3):g}" for case, number in mark.cases.worst)
        data |= {"data_worst": worst, "data_what": mark.cases.what}
    return _attributes(class_="pick", aria_label=f"{place}: {say(mark)}", **data)


def _svg(
    written: io.BytesIO, groups: Mapping[str, _Group], name: str, label: str, kind: str, **data: str
) -> Markup:
    """The element that a page takes of a file; label: what it shows, in words."""
    root = ElementTree.fromstring(written.getvalue())
    used = re.findall(rb'(?:href="#|url\(#)([^")]+)', written.getvalue())
    ids = {each.decode(): f"{name}-{number}" for number, each in enumerate(dict.fromkeys(used))}
    shapes = {
        each.get("id", ""): each.attrib.pop("style", "") for each in root.iter() if each.get("id") in ids
    }
    inside = _Writer(groups, ids, shapes).all_of(root)
    words = _attributes(role="group", aria_label=label) if label else _attributes(aria_hidden="true")
    start = _attributes(class_=kind, viewBox=root.get("viewBox", ""), **data)
    return Markup(f"<svg{start}{words}>{inside}</svg>")


@dataclass(frozen=True)
class _Writer:
    """Writes elements without what means nothing within a page. ids: those used, and what they are here;
    shapes: the style of each."""

    groups: Mapping[str, _Group]
    ids: Mapping[str, str]
    shapes: Mapping[str, str]

    def all_of(self, node: Element) -> str:
        return "".join(map(self.element, node))

    def element(self, node: Element) -> str:
        tag = _local(node.tag)
        if tag in DROPPED:
            return ""
        if (group := self.groups.get(node.get("id", ""))) is not None:
            return self.group(node, group)
        inside, attributes = self.all_of(node), self.attributes(node)
        if tag in ("g", "defs") and not inside:
            return ""
        if tag == "g" and not attributes:
            return inside
        text = str(escape(node.text)) if tag == "text" and node.text else ""
        return f"<{tag}{attributes}>{text}{inside}</{tag}>" if text or inside else f"<{tag}{attributes}/>"

    def group(self, node: Element, group: _Group) -> str:
        """What belongs to a method; its marks share one style."""
        marks = [each for each in node.iter() if _local(each.tag) == "use"]
        if not group.marks:
            return f"<g{group.attributes}>{self.all_of(node)}</g>"
        shape = marks[0].get(HREF, "")[1:]
        style = _style(f"{self.shapes[shape]}; {marks[0].get('style', '')}")
        for each in marks:
            each.attrib.pop("style", None)
        drawn = "".join(
            f"<use{self.attributes(each)}{pick}/>" for each, pick in zip(marks, group.marks, strict=True)
        )
        paths = "".join(map(self.element, (each for each in node.iter() if _local(each.tag) == "defs")))
        return f"<g{group.attributes}{style}>{paths}{drawn}</g>"

    def attributes(self, node: Element) -> str:
        """The attributes that matter, short: numbers with one decimal, ids of this page."""
        found = {_local(key): value for key, value in node.items()}
        texts = [f' id="{self.ids[found["id"]]}"'] if found.get("id") in self.ids else []
        for key in KEPT:
            if key == "style":
                texts.append(_style(found.get(key, "")))
            elif key in ("href", "clip-path") and key in found:
                own = re.sub(r"#([^)]+)", lambda match: f"#{self.ids[match[1]]}", found[key])
                texts.append(f' {key}="{own}"')
            elif key in found and not found[key].startswith("rotate(-0 "):
                texts.append(f' {key}="{_short(found[key])}"')
        return "".join(texts)


def _local(name: Any) -> str:
    """The name of an element or attribute without its namespace."""
    return str(name).rpartition("}")[2]


def _short(text: str) -> str:
    """Coordinates with one decimal, and no more blanks than they need."""
    rounded = re.sub(
        r"-?\d+\.\d+(e-?\d+)?", lambda match: f"{float(match[0]):.1f}".removesuffix(".0"), text
    )
    return re.sub(r"\s*([A-Za-z])\s*", r"\1", " ".join(rounded.split())).replace(" -", "-")


def _style(text: str) -> str:
    """The properties that matter, each once."""
    parts = (each.partition(":") for each in text.split(";") if ":" in each)
    properties = {key.strip(): value.strip() for key, _, value in parts}
    size = re.search(r"[\d.]+px", properties.get("font-size", properties.get("font", "")))
    kept = {key: value for key, value in properties.items() if key not in OWN}
    kept |= {"font-size": size[0]} if size else {}
    joined = ";".join(f"{key}:{value}" for key, value in kept.items())
    return f' style="{joined}"' if joined else ""
