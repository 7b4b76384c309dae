"""A picture of how a file was understood: its body at rest with the roles of its joints.

It is seen from the front and from its right side. Bones are coloured by side, those to joints without a
role are grey. Every joint has a label beside the body, joints of the sides in the front view and all others
in the side view, with a line to where it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from retarget_bench.api import Ground
from retarget_bench.figures import palette
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.body import PosedBody
from retarget_bench.motion.character import Character
from retarget_bench.motion.findings import NO_ROLE, Findings
from retarget_bench.motion.importer import Imported
from retarget_bench.viewer.bodies import Solid, sides
from retarget_bench.viewer.camera import axes, fitted
from retarget_bench.viewer.colours import FAINT, INK, PAPER, STAGE, TROUBLE, Colour, mixed, of_hex
from retarget_bench.viewer.renderer import PAD, Stage
from retarget_bench.viewer.scene import Figure
from retarget_bench.viewer.text import font, short

GROUPS = ("middle", "left", "right", "no role")
COLOURS: tuple[Colour, ...] = (
    of_hex(palette.COLOURS[3]),
    of_hex(palette.COLOURS[0]),
    of_hex(palette.COLOURS[1]),
    (150, 154, 160),
)
"""Of the bones of ``GROUPS``."""
NO_ROLE_GROUP = GROUPS.index("no role")
LETTER, LINE = 12, 16
"""Pixels: size of letters, and from one label to the next."""
PANEL, LABELS = 480, 290
"""Pixels: width of a view, and of the labels on either side of it."""
LOWEST, HIGHEST = 640, 2400
"""Pixels of a sheet's height."""
EDGE = 14
"""Pixels between a label and its view, which the first piece of its line crosses."""
OFF_MIDDLE = 0.03
"""Heights from the middle of the body beyond which a joint without a role is of a side."""
ARROW = 0.42
"""Length of the arrow that shows where the body faces, in heights of the picture's body."""


@dataclass(frozen=True)
class Label:
    """A joint's words and where it is seen in the picture, pixels."""

    words: str
    at: tuple[float, float]
    colour: Colour


def role_sheet(imported: Imported) -> Image.Image:
    """The picture of a file, RGB: as wide as two views with labels need, as high as the labels ask for."""
    body, findings = imported.motion.character, imported.findings
    groups = joint_groups(body)
    places, note = resting_places(body)
    solid = Solid(
        Figure("", "motion", body, places[None]), COLOURS[0], groups=groups, group_colours=COLOURS
    )
    off_middle = np.abs(places[:, 0]) > OFF_MIDDLE * _tall(solid)
    beside = np.isin(groups, (1, 2)) | ((groups == NO_ROLE_GROUP) & off_middle)
    shown = [np.flatnonzero(beside), np.flatnonzero(~beside)]
    rows = max(-(-len(joints) // 2) for joints in shown)
    head = 5 * LINE
    high = int(np.clip(rows * LINE + 2 * LINE, LOWEST - head, HIGHEST - head))
    width = 2 * (PANEL + 2 * LABELS)
    picture = Image.new("RGB", (width, head + high + LINE), PAPER)
    pen = ImageDraw.Draw(picture)
    _heading(pen, findings, note, width)
    for number, (view, joints) in enumerate(zip(("front", "side"), shown, strict=True)):
        left = number * (PANEL + 2 * LABELS) + LABELS
        stage = stage_of(solid, view, (PANEL, high))
        picture.paste(stage.picture(0), (left, head))
        if findings.facing is not None:
            _arrow(pen, stage, (left, head))
        _size(pen, stage, (left, head))
        direction = "from the front" if view == "front" else "from the right"
        pen.text((left + 6, head + 4), direction, FAINT, font(LETTER))
        pixels = stage.camera.project(places, stage.targets[0])[0] + (left, head)
        labels = [_label(findings, joint, pixels[joint], groups[joint]) for joint in joints.tolist()]
        _labels(pen, labels, (left, head, PANEL, high))
    return picture


def joint_groups(body: Character) -> np.ndarray:
    """``(joints,)`` places in ``GROUPS``: the side of each joint's role, or that it has none."""
    numbers = {"-": 0, "l": 1, "r": 2, "h": 0}
    return np.array(
        [
            NO_ROLE_GROUP if role is None else numbers[side]
            for side, role in zip(sides(body), body.roles, strict=True)
        ]
    )


def resting_places(body: Character) -> tuple[np.ndarray, str]:
    """``(joints, 3)`` metres of the body at rest, turned to face +Z and set on y = 0, and in which pose.

    A rest pose that no body could take (bones all along one axis) shows nothing: there it is the reference
    pose.
    """
    posed = PosedBody(body.skeleton, body.roles)
    if posed.frame is not None and not posed.rests_in_a_pose:
        places, note = np.array(body.reference_places), "shown in the reference pose"
    else:
        pose = rotation.identity(len(body.skeleton))
        if posed.frame is not None:
            posed.set_global(pose, posed.hips, posed.frame)
        places, note = kinematics.forward(body.skeleton, pose, np.zeros(3))[0], "shown at rest"
    places = places - places[posed.hips]
    places[:, 1] -= places[:, 1].min()
    return places, note


def stage_of(solid: Solid, view: str, size: tuple[int, int]) -> Stage:
    """One view of a body that stands on the floor below its hips."""
    target = np.zeros((1, 3))
    around = np.concatenate([solid.places[0], [[0.0, 0.0, ARROW * _tall(solid)]]])
    turned = axes(view, solid.body, solid.places[0])
    (camera,) = fitted([(turned, around)], PAD * max(solid.size, _tall(solid)), size)
    return Stage((solid,), Ground(), camera, target, size)


def _tall(solid: Solid) -> float:
    """Metres from the floor to the highest joint, at least a tenth of how far the body reaches."""
    return max(float(solid.places[0, :, 1].max()), 0.1 * float(np.ptp(solid.places[0], axis=0).max()), 1e-6)


# ---------------------------------------------------------------------------------------------- drawing
def _heading(pen: ImageDraw.ImageDraw, findings: Findings, note: str, width: int) -> None:
    """What the file is, and the key of the colours."""
    bold, letters, facts = font(LETTER + 4, bold=True), font(LETTER), findings.facts
    pen.text((10, 8), short(findings.path.name, bold, width - 420), INK, bold)
    for line, headings in enumerate((("body", "unit", "up axis"), ("rest pose", "facing"))):
        words = " · ".join(f"{heading}: {facts[heading]}" for heading in headings)
        words += f" · {note}" if line else ""
        pen.text((10, 12 + (line + 1.3) * LINE), short(words, letters, width - 20), INK, letters)
    right: float = width - 10
    for name, colour in reversed(list(zip(GROUPS, COLOURS, strict=True))):
        right -= letters.getlength(name)
        pen.text((right, 10), name, INK, letters)
        pen.rectangle((right - 18, 12, right - 6, 23), colour)
        right -= 34


def _label(findings: Findings, joint: int, at: np.ndarray, group: int) -> Label:
    name, meaning = findings.joints[joint]
    has_role = meaning not in NO_ROLE
    doubt = meaning == "not understood"
    bare = name.rpartition(":")[2] or name
    words = f"{bare}: {meaning}" if has_role or doubt else bare
    colour = TROUBLE if doubt else FAINT if not has_role else mixed(COLOURS[group], (0, 0, 0), 0.25)
    return Label(words, (float(at[0]), float(at[1])), colour)


def _labels(pen: ImageDraw.ImageDraw, labels: Sequence[Label], box: tuple[int, int, int, int]) -> None:
    """Labels on both sides of a view, in the order of the heights of their joints."""
    left, top, wide, high = box
    letters = font(LETTER)
    for side, column in zip((-1, 1), halves(labels, high // LINE), strict=True):
        edge = left if side < 0 else left + wide
        near, text = edge + side * 4, edge + side * EDGE
        for label, y in spread(column, edge, top, top + high):
            words = short(label.words, letters, LABELS - EDGE - 8)
            line = mixed(label.colour, STAGE, 0.55)
            pen.line([(text, y), (near, y), label.at], fill=line, width=1)
            x, at_y = label.at
            pen.ellipse((x - 2, at_y - 2, x + 2, at_y + 2), fill=label.colour, outline=PAPER)
            pen.text((text + side * 2, y), words, label.colour, letters, anchor="rm" if side < 0 else "lm")


def halves(labels: Sequence[Label], most: int) -> tuple[list[Label], list[Label]]:
    """Labels for the left and the right of a view, cut in the middle of where they are; at most so many on
    either side, as long as both have room."""
    across = sorted(labels, key=lambda label: label.at[0])
    middle = (across[0].at[0] + across[-1].at[0]) / 2 if across else 0.0
    most = max(most, -(-len(across) // 2))
    left = int(np.clip(sum(label.at[0] < middle for label in across), len(across) - most, most))
    return across[:left], across[left:]


def spread(labels: Sequence[Label], edge: float, top: float, bottom: float) -> list[tuple[Label, float]]:
    """Labels of one column with the heights of their middles, as near to their joints as they can be
    without touching. edge: where the column is; of joints at one height the farthest from it come first."""
    ordered = sorted(labels, key=lambda label: (round(label.at[1] / LINE), -abs(label.at[0] - edge)))
    step = min(LINE, (bottom - top) / max(len(ordered), 1))
    pooled: list[tuple[float, int]] = []  # mean height of the first of labels that touch, and how many
    for number, label in enumerate(ordered):
        height, count = label.at[1] - number * step, 1
        while pooled and pooled[-1][0] >= height:
            above, many = pooled.pop()
            height, count = (above * many + height * count) / (many + count), many + count
        pooled.append((height, count))
    firsts = np.repeat([height for height, _ in pooled], [count for _, count in pooled])
    within = np.clip(firsts, top + step / 2, bottom + step / 2 - len(ordered) * step)
    return list(zip(ordered, (within + step * np.arange(len(ordered))).tolist(), strict=True))


def _arrow(pen: ImageDraw.ImageDraw, stage: Stage, corner: tuple[int, int]) -> None:
    """Where the body faces, on the floor, and the word for it."""
    reach = np.array([[0.0, 0.0, 0.15], [0.0, 0.0, 1.0]]) * ARROW * _tall(stage.solids[0])
    start, tip = stage.camera.project(reach, stage.targets[0])[0] + corner
    along = (tip - start) / max(float(np.linalg.norm(tip - start)), 1e-9)
    across, base = np.array([-along[1], along[0]]), tip - 12 * along
    pen.line([tuple(start), tuple(base)], fill=INK, width=3)
    pen.polygon([tuple(point) for point in (tip, base + 6 * across, base - 6 * across)], fill=INK)
    pen.text(
        tuple(tip + 6 * along + (4, 0)), "front", INK, font(LETTER), anchor="lm" if along[0] > 0.5 else "ma"
    )


def _size(pen: ImageDraw.ImageDraw, stage: Stage, corner: tuple[int, int]) -> None:
    """The height of the body, beside it."""
    solid, camera = stage.solids[0], stage.camera
    top = float(solid.places[0, :, 1].max())
    ends = camera.project(np.array([[0.0, 0.0, 0.0], [0.0, top, 0.0]]), stage.targets[0])[0] + corner
    x = corner[0] + 12.0
    (_, low), (_, high) = ends.tolist()
    pen.line([(x, low), (x, high)], fill=FAINT, width=1)
    for y in (low, high):
        pen.line([(x - 4, y), (x + 4, y)], fill=FAINT, width=1)
    pen.text((x - 4, low + 4), f"{top:.3g} m", FAINT, font(LETTER))
