"""Attention of a method: a heat map on the skeleton and over time (PAN, Figure 8)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget_bench.figures.plotting import canvas
from retarget_bench.motion import facing

if TYPE_CHECKING:
    from retarget_bench.evaluation.attention import Attention
    from retarget_bench.motion.motion import Motion

UNASKED = 5
"""Poses that are drawn where no times are asked for."""
AROUND, AROUND_FOUR = np.radians(35.0), np.radians(65.0)
"""From how far beside its front a body is seen: a person three-quarters on, a dog nearly from the side."""
ABOVE = np.radians(12.0)

UNSEEN = "0.8"
EDGE = "0.25"
NARROW = 0.02
"""The least range of weights that colours are spread over: what is even has to look even."""


def spread(frames: int) -> list[int]:
    """The frames that are drawn by default: from the first to the last, each once."""
    return sorted({int(frame) for frame in np.linspace(0, frames - 1, UNASKED).round()})


def draw(path: Path, attention: Attention, source: Motion, frames: Sequence[int], title: str) -> None:
    """Poses side by side, bones coloured by the weight of the joint that they lead to; all joints over
    time below, by part.

    frames: which are drawn as poses. Where several parts heed a joint, its colour is that of the largest
    weight (section 6.2.2 of the paper). Raises BenchError where the file is of no known kind.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    canvas.ending(path)
    weights = attention.weights[:, attention.sees]
    least, most = float(weights.min()), float(weights.max())
    rows = int(attention.sees.sum())
    wide, strip = max(6.4, 1.5 * len(frames) + 1.6), 0.9 + 0.13 * rows
    scale = ScalarMappable(Normalize(least, max(most, least + NARROW)), canvas.errors_map())
    with canvas.drawn(path, wide, 3.1 + strip) as figure:
        poses, below = figure.subplots(2, 1, height_ratios=(2.8, strip))
        _poses(poses, attention, source, frames, scale)
        _strip(below, attention, source, frames, scale)
        figure.colorbar(scale, ax=[poses, below], label="attention weight", pad=0.01, aspect=40)
        figure.suptitle("\n".join(line for line in (title, attention.note) if line), fontsize=8)


# -------------------------------------------------------------------------------------------------- poses
def _poses(panel: Any, attention: Attention, source: Motion, frames: Sequence[int], scale: Any) -> None:
    """The poses from left to right, each from where its front is, all of one size and on one floor."""
    poses_2d = projected(source, frames)
    floor = projected(source, spread(source.frames))[..., 1].min()
    step = 1.15 * max(float(np.ptp(poses_2d[..., 0], axis=1).max()), 0.4 * source.character.height)
    for place, (frame, pose) in enumerate(zip(frames, poses_2d, strict=True)):
        middle = 0.5 * (pose[:, 0].min() + pose[:, 0].max())
        pose[:, 0] += place * step - middle
        _pose(panel, attention, source, frame, pose, scale)
        panel.annotate(f"{frame / source.fps:.2f} s", (place * step, floor), (0, -4), fontsize=8,
                       textcoords="offset points", ha="center", va="top")  # fmt: skip
    panel.set(aspect="equal", xticks=[], yticks=[])
    panel.set_xlim(-0.6 * step, (len(frames) - 0.4) * step)
    panel.grid(visible=False)
    panel.spines[:].set_visible(False)


def _pose(
    panel: Any, attention: Attention, source: Motion, frame: int, pose: np.ndarray, scale: Any
) -> None:
    """Draw a pose, nearer bones on top. pose: ``(joints, 3)`` right, up and towards the viewer."""
    from matplotlib.collections import LineCollection
    from matplotlib.patheffects import Normal, Stroke

    weight = {int(j): w for j, w in zip(attention.joints, attention.largest[frame], strict=True)}
    parents = source.skeleton.parents
    bones = [joint for joint in range(len(parents)) if parents[joint] >= 0]
    bones.sort(key=lambda joint: pose[joint, 2] + pose[parents[joint], 2])
    ends = [(pose[parents[joint], :2], pose[joint, :2]) for joint in bones]
    colours = [scale.to_rgba(weight[joint]) if joint in weight else UNSEEN for joint in bones]
    edge = [Stroke(linewidth=5.0, foreground=EDGE), Normal()]
    panel.add_collection(LineCollection(ends, colors=colours, linewidths=3.6, capstyle="round",
                                        path_effects=edge, zorder=2))  # fmt: skip
    nearest_last = sorted(weight, key=lambda joint: pose[joint, 2])
    panel.scatter(*pose[nearest_last, :2].T, s=26, c=[scale.to_rgba(weight[j]) for j in nearest_last],
                  edgecolors=EDGE, linewidths=0.7, zorder=3)  # fmt: skip


def projected(source: Motion, frames: Sequence[int]) -> np.ndarray:
    """``(len(frames), joints, 3)`` metres: right, up and towards the viewer, a little from above and
    from beside where the body faces in each frame. The level origin is at the root joint."""
    character = source.character
    places = source.positions[list(frames)]
    turn = np.ones(len(frames), dtype=complex)
    if not facing.unknown(character):
        turn = facing.facing(source.positions, character, source.fps / 6.0)[list(frames)]
    beside = AROUND_FOUR if character.four_legged else AROUND
    level = places[:, :1] * [1.0, 0.0, 1.0]
    left, up, ahead = np.moveaxis(facing.seen(places - level, (turn * np.exp(1j * beside))[:, None]), -1, 0)
    sine, cosine = np.sin(ABOVE), np.cos(ABOVE)
    return np.stack([left, cosine * up - sine * ahead, sine * up + cosine * ahead], axis=-1)


# -------------------------------------------------------------------------------------------------- strip
def _strip(panel: Any, attention: Attention, source: Motion, frames: Sequence[int], scale: Any) -> None:
    """A row for each joint that a part sees, part by part; time goes to the right."""
    rows = np.argwhere(attention.sees)
    values = attention.weights[:, rows[:, 0], rows[:, 1]].T
    half, last = 0.5 / source.fps, (source.frames - 1) / source.fps
    panel.imshow(
        values, cmap=scale.cmap, norm=scale.norm, aspect="auto", interpolation="nearest",
        extent=(-half, last + half, len(rows) - 0.5, -0.5),
    )  # fmt: skip
    names = [source.skeleton.names[attention.joints[joint]] for _, joint in rows]
    panel.set_yticks(range(len(rows)), names, fontsize=6)
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("seconds")
    panel.grid(visible=False)
    for frame in frames:
        panel.axvline(frame / source.fps, color="0.1", linestyle=":", linewidth=0.8)
    for part, name in enumerate(attention.parts):
        own = np.flatnonzero(rows[:, 0] == part)
        panel.text(last + half, own.mean(), f" {name.replace('_', ' ')}", fontsize=7, va="center")
        if own[0]:
            panel.axhline(own[0] - 0.5, color="0.1", linewidth=0.8)
