"""Drawing scenes without a display: side by side, overlaid, and contact sheets."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from PIL import Image, ImageDraw

from retarget_bench.errors import BenchError
from retarget_bench.viewer.colours import (
    FAINT,
    INK,
    LIT,
    PAPER,
    STAGE,
    STRIPE,
    TROUBLE,
    Colour,
    colours,
    tints,
)
from retarget_bench.viewer.renderer import SMALLEST, DrawingStyle, Stage, stages
from retarget_bench.viewer.scene import Figure, Scene
from retarget_bench.viewer.text import Font, font, plain, short, wrapped

GAP = 4
"""Pixels between panels."""
KEY = "striped: limb inside the body"
"""The meaning of stripes."""


@dataclass(frozen=True)
class Box:
    """A rectangle of a picture: left, top, width and height in pixels."""

    left: int
    top: int
    width: int
    height: int

    @property
    def corners(self) -> tuple[int, int, int, int]:
        return self.left, self.top, self.left + self.width - 1, self.top + self.height - 1


class Drawing:
    """A scene laid out in one picture, of any of its frames.

    frames: those that will be drawn, which the camera is fitted to; all by default.
    """

    def __init__(
        self, scene: Scene, style: DrawingStyle | None = None, frames: Sequence[int] | None = None
    ) -> None:
        self.scene, self.look = scene, style or DrawingStyle()
        self.frames = frames if frames is not None else range(scene.frames)
        self._shown = list(zip(scene.figures, colours(scene), strict=True))
        # In pixels: the size of letters, from one line to the next, above all panels, and below each.
        self._letter = int(np.clip(round(min(self.look.size) / 42), 9, 20))
        self._line, self._head = round(1.4 * self._letter), round(2.2 * self._letter)
        drawn = [figure for figure in scene.figures if figure.positions is not None]
        notes = any(figure.error is not None for figure in drawn) + any(figure.message for figure in drawn)
        self._foot = (1 + notes) * self._line + round(0.4 * self._letter)
        self._legend_columns = int(np.clip(self.look.size[0] // (30 * self._letter), 1, 3))
        self._legend_rows = -(-len(scene.figures) // self._legend_columns)
        self._boxes, self._stages = self._laid_out()

    def at(self, frame: int) -> Image.Image:
        """An RGB picture of a frame."""
        picture = self._base.copy()
        pen = ImageDraw.Draw(picture)
        for box, stage in zip(self._boxes, self._stages, strict=True):
            if stage is not None:
                picture.paste(stage.picture(frame), (box.left, box.top))
        self._draw_words(pen, frame)
        return picture

    # --------------------------------------------------------------------------------------- layout
    def _laid_out(self) -> tuple[list[Box], list[Stage | None]]:
        """Panels and their stages (None: nothing to draw), in as many columns as make bodies largest."""
        if self.look.overlay:
            high = self.look.size[1] - self._head - self._legend_rows * self._line - GAP
            box = Box(GAP, self._head, self.look.size[0] - 2 * GAP, high)
            return [box], self._stages_in(box)
        best: tuple[float, list[Box], list[Stage | None]] | None = None
        for columns in range(1, len(self.scene.figures) + 1):
            boxes = self._grid(columns)
            if min(boxes[0].width, boxes[0].height) < SMALLEST and best is not None:
                continue
            stages = self._stages_in(boxes[0])
            zoom = next(stage.camera.zoom for stage in stages if stage is not None)
            if best is None or zoom > best[0] * 1.02:
                best = zoom, boxes, stages
        assert best is not None
        return best[1], best[2]

    def _stages_in(self, box: Box) -> list[Stage | None]:
        return stages(self.scene, self.look, self.frames, (max(box.width, 8), max(box.height, 8)))

    def _grid(self, columns: int) -> list[Box]:
        count = len(self.scene.figures)
        rows = -(-count // columns)
        wide = (self.look.size[0] - GAP * (columns + 1)) // columns
        high = (self.look.size[1] - self._head) // rows - self._foot
        return [
            Box(GAP + column * (wide + GAP), self._head + row * (high + self._foot), wide, high)
            for row, column in (divmod(k, columns) for k in range(count))
        ]

    # --------------------------------------------------------------------------------------- words
    @cached_property
    def _base(self) -> Image.Image:
        """The parts that are the same in all frames."""
        picture = Image.new("RGB", self.look.size, PAPER)
        pen = ImageDraw.Draw(picture)
        letters = font(self._letter, bold=True)
        room = self.look.size[0] - 2 * GAP - self._clock_room
        if shows_penetration(self.scene, self.look):
            room = draw_key(pen, room, self._head, self._letter)
        pen.text(
            (GAP + 2, self._head / 2),
            short(title(self.scene), letters, room - 20),
            INK,
            letters,
            anchor="lm",
        )
        for box in self._boxes:
            pen.rectangle(box.corners, STAGE)
        if not self.look.overlay:
            for box, stage, (figure, colour) in zip(self._boxes, self._stages, self._shown, strict=True):
                self._name(pen, box, figure, colour)
                if stage is None:
                    draw_reason(pen, box, figure, self._letter)
        return picture

    @property
    def _clock_room(self) -> float:
        return font(self._letter).getlength(self._clock(self.scene.frames))

    def _name(self, pen: ImageDraw.ImageDraw, box: Box, figure: Figure, colour: Colour) -> None:
        """A figure's colours, name and message below its panel."""
        line = self._line
        top = box.top + box.height + 0.3 * self._letter
        draw_chip(pen, box.left, top + 0.15 * self._letter, self._letter, colour)
        letters = font(self._letter, bold=True)
        room = box.width - 2.1 * self._letter
        pen.text((box.left + 2.1 * self._letter, top), short(figure.label, letters, room), INK, letters)
        if figure.positions is not None and figure.message:
            small = font(self._letter - 1)
            row = 1 + (figure.error is not None)
            pen.text((box.left, top + line * row), short(figure.message, small, box.width), FAINT, small)

    def _draw_words(self, pen: ImageDraw.ImageDraw, frame: int) -> None:
        """The time, and every figure's error now."""
        letters = font(self._letter)
        right = self.look.size[0] - GAP - 2
        pen.text((right, self._head / 2), self._clock(frame), FAINT, letters, anchor="rm")
        if self.look.overlay:
            self._legend(pen, frame)
            return
        for box, stage, (figure, _) in zip(self._boxes, self._stages, self._shown, strict=True):
            top = box.top + box.height + 0.3 * self._letter + self._line
            pen.text((box.left, top), error_text(figure, frame, letters, box.width), FAINT, letters)
            if stage is not None and not stage.in_picture(frame):
                draw_away(pen, box, stage, frame, self._letter)

    def _legend(self, pen: ImageDraw.ImageDraw, frame: int) -> None:
        """Names and colours of the figures of an overlay, and of those missing."""
        letters, below = font(self._letter), self._boxes[0].top + self._boxes[0].height + GAP
        wide = (self.look.size[0] - 2 * GAP) // self._legend_columns
        for number, (figure, colour) in enumerate(self._shown):
            left = GAP + wide * (number // self._legend_rows)
            top = below + self._line * (number % self._legend_rows)
            draw_chip(pen, left, top + 0.15 * self._letter, self._letter, colour)
            left, room = left + round(2.1 * self._letter), wide - round(2.6 * self._letter)
            if figure.positions is None:
                words = short(f"{figure.label}: {figure.status}, {figure.message}", letters, room)
                pen.text((left, top), words, TROUBLE, letters)
                continue
            now = error_text(figure, frame, letters, 0.6 * room)
            name = short(figure.label, letters, room - letters.getlength(f"  {now}"))
            pen.text((left, top), f"{name}  {now}", INK, letters)

    def _clock(self, frame: int) -> str:
        return f"frame {frame + 1} of {self.scene.frames} · {frame / self.scene.fps:.2f} s"


# ------------------------------------------------------------------------------------- parts of pictures
def title(scene: Scene) -> str:
    return scene.title + (f" ({scene.kind})" if scene.kind else "")


def shows_penetration(scene: Scene, style: DrawingStyle) -> bool:
    """True where a picture has stripes on limbs that are inside the body."""
    return style.skin and any(figure.testable for figure in scene.figures)


def draw_key(pen: ImageDraw.ImageDraw, right: float, head: int, letter: int) -> float:
    """What stripes mean, in the heading up to a place, where it takes less than half of the room; returns
    the room that is left."""
    letters = font(letter - 1)
    chip = 2.2 * letter
    wide = letters.getlength(KEY) + chip + 2 * letter
    if wide > 0.55 * right:
        return right
    left, top, low = right - wide, head / 2 - 0.5 * letter, head / 2 + 0.5 * letter
    pen.rectangle((left, top, left + 1.5 * letter, low), LIT, STRIPE)
    for share in (0.1, 0.6, 1.1):
        x = left + share * letter
        pen.line((x, low, x + 0.4 * letter, top), STRIPE, 2)
    pen.text((left + chip, head / 2), KEY, FAINT, letters, anchor="lm")
    return left


def error_text(figure: Figure, frame: int, letters: Font, room: float) -> str:
    """A figure's error at a frame and on average, in as many words as there is room for; "" without one."""
    if figure.error is None:
        return ""
    now, mean = float(figure.error[frame]), float(np.nanmean(figure.error))
    longer = (f"error {now:.1f} % of height (mean {mean:.1f})", f"error {now:.1f} % (mean {mean:.1f})")
    return next((words for words in longer if letters.getlength(words) <= room), f"{now:.1f} %")


def draw_chip(pen: ImageDraw.ImageDraw, left: float, top: float, letter: int, colour: Colour) -> None:
    """A body's colours: its left, which is light, its middle, and its right, which is dark."""
    middle, light, dark = tints(colour)
    for number, tint in enumerate((light, middle, dark)):
        x = left + number * 0.55 * letter
        pen.rectangle((x, top, x + 0.55 * letter, top + 0.9 * letter), tint)


def draw_reason(pen: ImageDraw.ImageDraw, box: Box, figure: Figure, letter: int) -> None:
    """The reason why a panel has no figure."""
    bold, letters = font(letter, bold=True), font(letter)
    lines = max(1, int((box.height - 2 * letter) / (1.35 * letter)) - 1)
    reason = wrapped(figure.message, letters, box.width - 2 * letter, min(lines, 8))
    top = box.top + max(letter, (box.height - (len(reason) + 1.2) * 1.35 * letter) / 2)
    middle = box.left + box.width / 2
    pen.text((middle, top), short(figure.status, bold, box.width), TROUBLE, bold, anchor="ma")
    for number, words in enumerate(reason):
        pen.text((middle, top + (number + 1.2) * 1.35 * letter), words, INK, letters, anchor="ma")


def draw_away(pen: ImageDraw.ImageDraw, box: Box, stage: Stage, frame: int, letter: int) -> None:
    """Words for a figure that is not in its panel."""
    places = stage.solids[0].places[frame]
    far = float(np.linalg.norm(places.mean(axis=0) - stage.targets[frame]))
    letters, words = font(letter), f"out of view: {far:.1f} m away"
    if letters.getlength(words) > box.width:
        words = short(f"{far:.1f} m away", letters, box.width)
    pen.text((box.left + box.width / 2, box.top + box.height / 2), words, TROUBLE, letters, anchor="mm")


# ------------------------------------------------------------------------------------------------ sheets
MOST = 24
"""Columns of a sheet."""
CELL = 110
"""Pixels of the narrowest column that is chosen unasked."""
NAMES = 13
"""Letters of the widest line of names, of about 0.6 of their height each."""


def moments(frames: Sequence[int], count: int) -> list[int]:
    """At most ``count`` of these frames, evenly spread from the first to the last."""
    if not 1 <= count <= MOST:
        raise BenchError(f"a sheet has 1 to {MOST} columns, not {count}")
    places = np.linspace(0, len(frames) - 1, min(count, len(frames)))
    return [frames[place] for place in np.rint(places).astype(int).tolist()]


def usual_size(scene: Scene, columns: int, overlay: bool) -> tuple[int, int]:
    """Pixels that show every figure well."""
    rows = 1 if overlay else len(scene.figures)
    wide = max(1280 // max(columns, 4), CELL)
    return 170 + columns * wide, 80 + rows * round(1.15 * wide)


def sheet(scene: Scene, style: DrawingStyle, frames: Sequence[int]) -> Image.Image:
    """An RGB picture of a scene at some frames; ``style.overlay`` makes it a single row.

    Raises BenchError where the size leaves too little room for so many figures and moments.
    """
    width, height = style.size
    rows = 1 if style.overlay else len(scene.figures)
    letter = int(np.clip(round(min(width, 1.6 * height) / 70), 9, 20))
    head, names = round(2.2 * letter), round(NAMES * 0.62 * letter)
    wide = (width - names - GAP * (len(frames) + 1)) // len(frames)
    high = (height - head - round(1.8 * letter) - GAP * rows) // rows
    if min(wide, high) < SMALLEST:
        raise BenchError(
            f"{len(frames)} moments of {rows} figures do not fit on {width} x {height} pixels; give a "
            "larger --size, or fewer --columns"
        )
    picture = Image.new("RGB", style.size, PAPER)
    pen = ImageDraw.Draw(picture)
    bold, letters = font(letter, bold=True), font(letter)
    room: float = width - 2 * GAP
    if shows_penetration(scene, style):
        room = draw_key(pen, room, head, letter)
    pen.text((GAP + 2, head / 2), short(title(scene), bold, room), INK, bold, anchor="lm")
    for column, frame in enumerate(frames):
        middle = names + GAP + column * (wide + GAP) + wide / 2
        words = short(f"{frame / scene.fps:.2f} s", letters, wide)
        pen.text((middle, head + 0.6 * letter), words, FAINT, letters, anchor="mm")
    panels = stages(scene, style, frames, (wide, high))
    for row, stage in enumerate(panels):
        top = head + round(1.8 * letter) + row * (high + GAP)
        for column, frame in enumerate(frames):
            if stage is not None:
                box = Box(names + GAP + column * (wide + GAP), top, wide, high)
                picture.paste(stage.picture(frame), (box.left, box.top))
                if not stage.in_picture(frame):
                    draw_away(pen, box, stage, frame, letter)
        figures = scene.figures if style.overlay else scene.figures[row : row + 1]
        span = Box(names + GAP, top, width - names - 2 * GAP, high)
        if stage is None:
            pen.rectangle(span.corners, STAGE)
            draw_reason(pen, span, figures[0], letter)
        _names(pen, scene, figures, Box(GAP, top, names - GAP, high), letter)
    return picture


def _names(
    pen: ImageDraw.ImageDraw, scene: Scene, figures: Sequence[Figure], box: Box, letter: int
) -> None:
    """The figures of a row, with their mean errors, in the margin."""
    bold, letters, line = font(letter, bold=True), font(letter - 1), round(1.4 * letter)
    top = float(box.top + letter // 2)
    colour_of = dict(zip(scene.figures, colours(scene), strict=True))
    for figure in figures:
        draw_chip(pen, box.left, top, letter, colour_of[figure])
        top += line
        for words in wrapped(plain(figure.label).replace("[", " ["), bold, box.width, 3):
            pen.text((box.left, top), words, INK, bold)
            top += line
        if figure.error is not None:
            words = f"error {float(np.nanmean(figure.error)):.1f} %"
            pen.text((box.left, top), short(words, letters, box.width), FAINT, letters)
            top += line
        top += line // 2
