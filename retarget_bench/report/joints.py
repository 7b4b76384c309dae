"""Errors by joint, drawn on the target's skeleton in the common reference pose."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from markupsafe import Markup

from retarget_bench.analysis import statistics
from retarget_bench.analysis.breakdown import breakdown
from retarget_bench.errors import BenchError
from retarget_bench.motion import kinematics
from retarget_bench.motion.character import Character
from retarget_bench.report import charts
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.means import worst
from retarget_bench.report.pictures import Looks, Picture, by_split

VALUE = "mpjpe_h.joint"
WIDTH, HEIGHT, ABOVE = 150.0, 196.0, 22.0
NOTHING = 0.01
"""Where no joint is farther off, in % of the height, all look right: it is rounding."""
LEAST, MOST = 2.6, 7.5
"""Radii of joints without and with the largest error."""
TITLE = 19
"""Letters of a label above a skeleton."""
STRUCTURES = 3
"""Of each split those of most cases are drawn."""


@dataclass(frozen=True)
class JointChart:
    """Errors of one structure on one split. numbers: joint -> ``(methods, cases)`` of the value, of this
    unit and meaning."""

    split: Split
    body: Character
    numbers: Mapping[str, np.ndarray]
    unit: str
    meaning: str

    def means(self, row: int) -> dict[str, float]:
        """Joint -> mean over clips, of one method; joints that it has no number for are left out."""
        found = {}
        for joint, numbers in self.numbers.items():
            per_clip = statistics.per_clip(numbers[row], self.split.panel.clips)
            if not np.isnan(per_clip).all():
                found[joint] = float(np.nanmean(per_clip))
        return found


def joints(chapter: Chapter, looks: Looks) -> Picture | None:
    """A skeleton per method, for every split and structure, joints sized and coloured by their error."""
    del looks
    known = [each for split in reversed(chapter.splits) for each in _known(split, chapter.bodies)]
    if not known:
        return None
    highest = max(_highest(each) for each in known)
    drawn = [
        (
            f"{each.split.name}, structure {each.body.structure}, drawn as {each.body.name}",
            [_figure(each, row, label, highest) for row, label in _shown(each.split)],
        )
        for each in known
    ]
    return Picture(
        "joints",
        "By joint",
        f"{known[0].meaning[:1].upper()}{known[0].meaning[1:]}, on a body of the target's structure in the "
        "common reference pose (two-legged bodies from the front: their left is at the right). The larger "
        "and darker a joint, the farther off.",
        by_split(drawn),
        size="small",
        scale=f"{highest:.3g} {known[0].unit} and more",
    )


def _known(split: Split, bodies: Mapping[str, Character]) -> list[JointChart]:
    """The structures of a split that most cases have."""
    values = {key: each for key, each in split.panel.values.items() if key == VALUE}
    if not values:
        return []
    try:
        parts = breakdown(replace(split.panel, values=values), "joint")
    except BenchError:
        return []
    numbers = {part.part: part.numbers((VALUE, "")) for part in parts}
    structures = [bodies[i.target].structure if i.target in bodies else "" for i in split.panel.cases]
    found = []
    for structure, _ in Counter(each for each in structures if each).most_common(STRUCTURES):
        here = np.array([each == structure for each in structures])
        body = bodies[split.panel.cases[structures.index(structure)].target]
        names = [name for name in body.skeleton.names if name in numbers]
        mine = {name: np.where(here, numbers[name], np.nan) for name in names}
        if any((~np.isnan(each)).any() for each in mine.values()):
            unit, meaning = values[VALUE].unit, values[VALUE].meaning
            found.append(JointChart(split, body, mine, unit, meaning))
    return found


def _shown(split: Split) -> list[tuple[int, str]]:
    """Rows and labels without controls, unless there is nothing else."""
    rows = list(enumerate(split.panel.rows))
    plain = [(k, row.label) for k, row in rows if not row.header.method.control]
    return plain or [(k, row.label) for k, row in rows]


def _highest(found: JointChart) -> float:
    """The end of the scale: nearly all joints of ranked methods are below it."""
    rows = [row for row, _ in _shown(found.split) if found.split.ranked[row]]
    rows = rows or [row for row, _ in _shown(found.split)]
    numbers = sorted(number for row in rows for number in found.means(row).values())
    return max(numbers[int(0.97 * (len(numbers) - 1))], NOTHING) if numbers else NOTHING


def _figure(found: JointChart, row: int, label: str, highest: float) -> Markup:
    errors = found.means(row)
    places = _places(found.body)
    bones = [
        charts.tag(
            "line", x1=places[p][0], y1=places[p][1], x2=places[j][0], y2=places[j][1], class_="bone"
        )
        for j, p in enumerate(found.body.skeleton.parents.tolist())
        if p >= 0
    ]
    names = found.body.skeleton.names
    dots = [
        _joint(found, row, label, name, places[k], errors[name], highest)
        for k, name in sorted(enumerate(names), key=lambda each: errors.get(each[1], 0.0))
        if name in errors
    ]
    if not dots:
        return Markup()
    far = sorted(errors, key=lambda name: -errors[name])[:3]
    said = ", ".join(f"{name} {errors[name]:.3g}" for name in far)
    title = charts.tag(
        "g",
        charts.words(2.0, 13.0, charts.short(label, TITLE), "start", class_="title"),
        class_="axes",
        aria_hidden="true",
    )
    return charts.svg(WIDTH, HEIGHT, f"{label}: farthest off are {said} {found.unit}", title, *bones, *dots)


def _joint(
    found: JointChart,
    row: int,
    label: str,
    name: str,
    place: tuple[float, float],
    error: float,
    highest: float,
) -> Markup:
    share = min(1.0, error / highest)
    radius = LEAST + (MOST - LEAST) * share
    return charts.pick(
        f"{label}, {name}: {error:.3g} {found.unit}",
        charts.tag(
            "circle", cx=place[0], cy=place[1], r=radius, class_=f"joint {charts.shade(share * 0.999)}"
        ),
        split=found.split.name,
        method=label,
        worst=worst(found.numbers[name][row], "lower"),
        what=f"error of {name}, {found.unit}",
    )


def _places(body: Character) -> list[tuple[float, float]]:
    """Joints in the chart: from the front, four-legged bodies from their left."""
    pose = kinematics.forward(body.skeleton, body.reference_pose[None], np.zeros((1, 3)))[0][0]
    across = pose[:, 2] if body.four_legged else pose[:, 0]
    flat = np.stack([across, -pose[:, 1]], axis=1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    room = np.array([WIDTH - 22, HEIGHT - ABOVE - 18])
    scale = float((room / np.maximum(high - low, 1e-6)).min())
    centred = (flat - (low + high) / 2) * scale + np.array([WIDTH / 2, ABOVE + (HEIGHT - ABOVE) / 2])
    return [(float(x), float(y)) for x, y in centred]
