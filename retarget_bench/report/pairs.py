"""Errors by source and target, as heat maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from retarget_bench.analysis.breakdown import UNKNOWN
from retarget_bench.analysis.summary import Mean
from retarget_bench.report import charts
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.means import means, told, unit_text, worst
from retarget_bench.report.pictures import Looks, Picture, by_split

SQUARE, NAMES, ABOVE = 30.0, 74.0, 84.0
LONGEST = 12
"""Letters of a name that are shown."""
TITLE = 30
"""Letters of a label above a map."""
MOST = 24
"""Bodies on one side; where there are more, they are taken together by structure."""
BEHIND = 30
"""Cases that are kept behind a square."""

Pair = tuple[str, str]


@dataclass(frozen=True)
class Square:
    """A pair on a split. means: by method. here: ``(cases,)`` bool."""

    split: Split
    means: list[Mean | None]
    here: np.ndarray


def pairs(chapter: Chapter, looks: Looks) -> Picture | None:
    """A map per method: rows are sources, columns are targets, all splits in one."""
    del looks
    main = chapter.splits[0].main
    infos = [info for split in chapter.splits for info in split.panel.cases]
    names = {name: name for info in infos for name in (info.source, info.target)}
    if together := len(names) > MOST:
        names = {n: chapter.bodies[n].structure if n in chapter.bodies else UNKNOWN for n in names}
    squares = _squares(chapter, names)
    if all(source == target for source, target in squares):
        return None
    highest = _highest(squares)
    bodies = f"structures of bodies, of which there are {len(names)}" if together else "bodies"
    also = " Pairs of one structure are of two bodies." if together else ""
    return Picture(
        "pairs",
        "By pair of bodies",
        f"{main.label[:1].upper()}{main.label[1:]} by source (rows) and target (columns): {bodies}.{also} "
        "Numbers say the same as the colours; what is empty was not asked, or not answered.",
        by_split([("", [each for label in chapter.labels if (each := _map(label, squares, highest))])]),
        size="middle",
        scale=f"{highest:.3g}{unit_text(main.unit)} and more",
    )


def _squares(chapter: Chapter, names: Mapping[str, str]) -> dict[Pair, Square]:
    """Where two splits have the same pair, which only structures can be, the later one counts."""
    found: dict[Pair, Square] = {}
    for split in chapter.splits:
        if split.main.id != chapter.splits[0].main.id:
            continue
        mine = [(names[info.source], names[info.target]) for info in split.panel.cases]
        for pair in sorted(set(mine)):
            here = np.array([each == pair for each in mine])
            found[pair] = Square(split, means(split.numbers[:, here], split.panel.clips[here]), here)
    return found


def _highest(squares: Mapping[Pair, Square]) -> float:
    """The end of the scale: nearly all pairs of ranked methods, or of all where none is, are below it."""
    numbers = [
        (abs(mean.value), ranked)
        for square in squares.values()
        for mean, ranked in zip(square.means, square.split.ranked, strict=True)
        if mean is not None
    ]
    known = sorted([number for number, ranked in numbers if ranked] or [number for number, _ in numbers])
    return max(known[int(0.98 * (len(known) - 1))], 1e-9) if known else 1.0


def _map(label: str, squares: Mapping[Pair, Square], highest: float) -> Markup:
    sources, targets = (sorted({pair[side] for pair in squares}) for side in (0, 1))
    parts = [charts.words(2.0, 13.0, charts.short(label, TITLE), "start", class_="title")]
    for column, name in enumerate(targets):
        turn = f"translate({NAMES + SQUARE * (column + 0.62):.1f} {ABOVE - 5:.1f}) rotate(-55)"
        parts.append(charts.words(0.0, 0.0, charts.short(name, LONGEST), "start", transform=turn))
    for line, name in enumerate(sources):
        parts.append(
            charts.words(NAMES - 6, ABOVE + SQUARE * (line + 0.62), charts.short(name, LONGEST), "end")
        )
    drawn, values = [], {}
    for pair, square in squares.items():
        row = square.split.labels.index(label) if label in square.split.labels else -1
        mean = square.means[row] if row >= 0 else None
        if mean is not None:
            values[pair] = mean.value
            x, y = NAMES + SQUARE * targets.index(pair[1]), ABOVE + SQUARE * sources.index(pair[0])
            drawn.append(_square(square, row, mean, pair, (x, y), highest))
    if not drawn:
        return Markup()
    far = max(values, key=lambda pair: values[pair])
    return charts.svg(
        NAMES + SQUARE * len(targets) + 24,
        ABOVE + SQUARE * len(sources) + 4,
        f"{label} by pair: highest {far[0]} to {far[1]}, {values[far]:.3g}",
        charts.tag("g", *parts, class_="axes", aria_hidden="true"),
        *drawn,
    )


def _square(
    square: Square, row: int, mean: Mean, pair: Pair, place: tuple[float, float], highest: float
) -> Markup:
    split, (x, y) = square.split, place
    label, main = split.labels[row], split.main
    shade = charts.shade(abs(mean.value) / highest * 0.999)
    digits = f"{mean.value:.0f}" if abs(mean.value) >= 9.95 else f"{mean.value:.1f}"
    side = SQUARE - 1
    numbers = np.where(square.here, split.panel.numbers((main.id, ""))[row], np.nan)
    return charts.pick(
        f"{label}, {split.name}, {pair[0]} to {pair[1]}: {told(mean, split.digits, main.unit)}",
        charts.tag("rect", x=x + 0.5, y=y + 0.5, width=side, height=side, rx=2, class_=f"heat {shade}"),
        charts.words(x + SQUARE / 2, y + SQUARE / 2 + 3.5, digits, class_=f"on {shade}"),
        split=split.name,
        value=main.id,
        method=label,
        worst=worst(numbers, main.better, main.goal, BEHIND),
        what=f"{main.label}, {pair[0]} to {pair[1]}",
    )
