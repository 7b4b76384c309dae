"""Error by joint: on the skeleton, or as dots in rows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget_bench.analysis.breakdown import UNKNOWN, breakdown, structures_of
from retarget_bench.analysis.summary import Mean, split_summary
from retarget_bench.errors import BenchError
from retarget_bench.figures.plotting import canvas, edges, values
from retarget_bench.figures.plotting.dots import dots
from retarget_bench.results.header import ResultHeader

if TYPE_CHECKING:
    from retarget_bench.motion.character import Character
    from retarget_bench.results.result_matrix import ResultMatrix

COLOURS = "YlOrRd"
LEAST, MOST = 6.0, 70.0
"""Areas of joints, in square points, without and with the largest error."""
HIGHEST = 0.97
"""The share of all joints that the scale is spread over."""


@dataclass(frozen=True)
class JointFigure:
    """Errors by joint of one structure on one split.

    joints: names, in the order of the skeleton where it is known. means: label -> a mean per joint.
    targets: the bodies that they are of.
    """

    split: str
    structure: str
    clips: int
    joints: tuple[str, ...]
    means: Mapping[str, Sequence[Mean | None]]
    targets: tuple[str, ...]


def found(panel: ResultMatrix, value: str, structure: str | None = None) -> JointFigure:
    """The errors of one structure: the one asked for, or that of most cases.

    Raises BenchError where no case has a target of the structure.
    """
    narrow = replace(panel, values={value: panel.values[value]})
    structure_of = structures_of(panel)
    counts = Counter(structure_of.values())
    wanted = structure or counts.most_common(1)[0][0]
    if wanted not in counts:
        raise BenchError(
            f"{panel.split}: no target is of structure {wanted}; there are {', '.join(sorted(counts))}"
        )
    mine = np.array([structure_of[info.id] == wanted for info in panel.cases])
    parts = [split_summary(part.restricted(mine, part.part)) for part in breakdown(narrow, "joint")]
    parts = [part for part in parts if any(value in score.means for score in part.scores)]
    labels = [row.label for row in panel.rows]
    return JointFigure(
        panel.split,
        wanted,
        max((part.clips for part in parts), default=0),
        tuple(part.part for part in parts),
        {label: [values.mean_of(part, label, value) for part in parts] for label in labels},
        tuple(sorted({i.target for i, here in zip(panel.cases, mine, strict=True) if here})),
    )


def draw(
    path: Path,
    panel: ResultMatrix,
    value: str,
    bodies: Mapping[str, Character] | None = None,
    structure: str | None = None,
    page: canvas.Page = canvas.PAGE,
) -> None:
    """Draw a skeleton per method, its joints sized and coloured by their errors; or, without bodies, dots.

    bodies: character -> itself, of the data set. structure: of the targets; that of most cases unasked.
    Raises BenchError where the results do not have the value, or not that structure.
    """
    canvas.ending(path)
    what = values.shown([panel], value, "joint")
    errors = found(panel, value, structure)
    of = f"{errors.split}, targets of {canvas.told(errors.structure)}, {errors.clips} clips"
    title = f"{canvas.told(panel.dataset)}: {of}"
    if not any(map(any, errors.means.values())):
        raise BenchError(f"no method has {value} on {of}; bench table says why")
    body = next((bodies[name] for name in errors.targets if name in bodies), None) if bodies else None
    if bodies is not None and body is None:
        raise BenchError(
            f"the data set has no body of {errors.structure if errors.structure != UNKNOWN else 'these'}; "
            "--dots draws errors without one"
        )
    if body is None:
        _dots(path, errors, what, values.headers([panel]), title, page)
    else:
        _skeletons(path, errors, what, body, title, page)


# --------------------------------------------------------------------------------------------------- dots
def _dots(
    path: Path,
    errors: JointFigure,
    what: values.Shown,
    headers: Mapping[str, ResultHeader],
    title: str,
    page: canvas.Page,
) -> None:
    order = sorted(range(len(errors.joints)), key=lambda joint: -_worst(errors, joint))
    means = {label: [row[joint] for joint in order] for label, row in errors.means.items()}
    means = {label: row for label, row in means.items() if any(row)}
    edge = edges.edge({label: filter(None, row) for label, row in means.items()}, headers, what.declared)
    with canvas.drawn(path, page.width, 0.5 + 0.19 * len(order)) as figure:
        axes = figure.subplots()
        dots(axes, [errors.joints[joint] for joint in order], means, canvas.looks(headers, page), edge)
        axes.set(xlabel=what.axis)
        axes.set_xlim(left=0)
        canvas.title(figure, page, f"{title}, bars 95 %{edges.told([edge])}")
        canvas.legend(figure, [axes])


def _worst(errors: JointFigure, joint: int) -> float:
    """The median over methods of a joint's error."""
    known = [mean.value for row in errors.means.values() if (mean := row[joint]) is not None]
    return float(np.median(known)) if known else 0.0


# ---------------------------------------------------------------------------------------------- skeletons
def _skeletons(
    path: Path, errors: JointFigure, what: values.Shown, body: Character, title: str, page: canvas.Page
) -> None:
    shown = {label: row for label, row in errors.means.items() if any(row)}
    across = min(len(shown), page.across(1.25))
    down = math.ceil(len(shown) / across)
    known = [mean.value for row in shown.values() for mean in row if mean is not None]
    highest = max(float(np.quantile(known, HIGHEST)), 1e-9)
    places = seen(body)
    wide, tall = np.ptp(places, axis=0)
    height = (page.width - 0.8) / across * min(2.2, max(0.6, float(tall / max(wide, 1e-6))))
    with canvas.drawn(path, page.width, 0.4 + down * (height + 0.2)) as figure:
        grid = figure.subplots(down, across, squeeze=False)
        for axes, (label, row) in zip(grid.flat, shown.items(), strict=False):
            dot = _skeleton(axes, body, places, dict(zip(errors.joints, row, strict=True)), highest)
            axes.set_title(canvas.told(label))
        for axes in grid.flat:
            axes.set_axis_off()
        figure.colorbar(dot, ax=grid, label=what.axis, extend="max", pad=0.02, aspect=30)
        canvas.title(figure, page, title)


def _skeleton(
    axes: Any, body: Character, places: np.ndarray, means: Mapping[str, Mean | None], highest: float
) -> Any:
    """Bones, and a dot per joint that has a number; what is drawn last, the worst, lies on top."""
    from matplotlib.collections import LineCollection

    parents = body.skeleton.parents
    bones = [
        (places[parents[joint]], places[joint]) for joint in range(len(parents)) if parents[joint] >= 0
    ]
    axes.add_collection(LineCollection(bones, colors="0.6", linewidths=1.5, zorder=1))
    numbers = {
        joint: mean.value
        for joint, name in enumerate(body.skeleton.names)
        if (mean := means.get(name)) is not None
    }
    order = sorted(numbers, key=lambda joint: numbers[joint])
    errors = np.array([numbers[joint] for joint in order])
    dots = axes.scatter(
        *places[order].T, s=LEAST + (MOST - LEAST) * np.minimum(errors / highest, 1.0), c=errors,
        cmap=COLOURS, vmin=0.0, vmax=highest, edgecolors="0.2", linewidths=0.5, zorder=2,
    )  # fmt: skip
    axes.set_aspect("equal")
    axes.margins(0.08)
    return dots


def seen(body: Character) -> np.ndarray:
    """``(joints, 2)`` metres, right and up, in the common reference pose: people from the front, so that
    their left is at the right; four-legged bodies from their left."""
    from retarget_bench.motion import kinematics

    pose = kinematics.forward(body.skeleton, body.reference_pose[None], np.zeros((1, 3)))[0][0]
    across = -pose[:, 2] if body.four_legged else pose[:, 0]
    return np.stack([across, pose[:, 1]], axis=1)
