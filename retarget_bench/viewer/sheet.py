"""Contact sheets: a row per figure, a column per moment."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from retarget_bench.errors import BenchError
from retarget_bench.viewer.colours import FAINT, INK, PAPER, STAGE, colours
from retarget_bench.viewer.drawing import GAP, SMALLEST, Box, DrawingStyle, away, chip, nothing, staged
from retarget_bench.viewer.renderer import Stage
from retarget_bench.viewer.scene import Figure, Scene
from retarget_bench.viewer.text import font, plain, short, wrapped

MOST = 24
"""Columns of a sheet."""
CELL = 110
"""Pixels of the narrowest column that is chosen unasked."""
NAMES = 13
"""Letters of the widest line of names, of about 0.6 of their height each."""


def moments(frames: Sequence[int], count: int) -> list[int]:
    """So many of these frames, evenly spread from the first to the last; all where there are fewer."""
    if not 1 <= count <= MOST:
        raise BenchError(f"a sheet has 1 to {MOST} columns, not {count}")
    places = np.linspace(0, len(frames) - 1, min(count, len(frames)))
    return [frames[place] for place in np.rint(places).astype(int).tolist()]


def usual_size(scene: Scene, columns: int, overlay: bool) -> tuple[int, int]:
    """Pixels that show every figure well."""
    rows = 1 if overlay else len(scene.figures)
    wide = max(1280 // max(columns, 4), CELL)
    return 170 + columns * wide, 80 + rows * round(1.15 * wide)


def sheet(scene: Scene, look: DrawingStyle, frames: Sequence[int]) -> Image.Image:
    """An RGB picture of a scene at some frames; ``look.overlay`` makes it a single row.

    Raises BenchError where the size leaves too little room for so many figures and moments.
    """
    width, height = look.size
    rows = 1 if look.overlay else len(scene.figures)
    letter = int(np.clip(round(min(width, 1.6 * height) / 70), 9, 20))
    head, names = round(2.2 * letter), round(NAMES * 0.62 * letter)
    wide = (width - names - GAP * (len(frames) + 1)) // len(frames)
    high = (height - head - round(1.8 * letter) - GAP * rows) // rows
    if min(wide, high) < SMALLEST:
        raise BenchError(
            f"{len(frames)} moments of {rows} figures do not fit on {width} x {height} pixels; give a "
            "larger --size, or fewer --columns"
        )
    picture = Image.new("RGB", look.size, PAPER)
    pen = ImageDraw.Draw(picture)
    _headings(pen, scene, look, frames, (names, wide, head, letter))
    made = staged(scene, look, frames, (wide, high))
    for row, stage in enumerate(made):
        top = head + round(1.8 * letter) + row * (high + GAP)
        for column, frame in enumerate(frames):
            box = Box(names + GAP + column * (wide + GAP), top, wide, high)
            _cell(picture, pen, box, stage, frame, letter)
        figures = scene.figures if look.overlay else scene.figures[row : row + 1]
        span = Box(names + GAP, top, width - names - 2 * GAP, high)
        if stage is None:
            pen.rectangle(span.corners, STAGE)
            nothing(pen, span, figures[0], letter)
        _names(pen, scene, figures, Box(GAP, top, names - GAP, high), letter)
    return picture


def _headings(
    pen: ImageDraw.ImageDraw,
    scene: Scene,
    look: DrawingStyle,
    frames: Sequence[int],
    sizes: tuple[int, int, int, int],
) -> None:
    """The title, and the time above every column."""
    names, wide, head, letter = sizes
    bold, letters = font(letter, bold=True), font(letter)
    title = scene.title + (f" ({scene.kind})" if scene.kind else "")
    pen.text((GAP + 2, head / 2), short(title, bold, look.size[0] - 2 * GAP), INK, bold, anchor="lm")
    for column, frame in enumerate(frames):
        middle = names + GAP + column * (wide + GAP) + wide / 2
        words = short(f"{frame / scene.fps:.2f} s", letters, wide)
        pen.text((middle, head + 0.6 * letter), words, FAINT, letters, anchor="mm")


def _cell(
    picture: Image.Image, pen: ImageDraw.ImageDraw, box: Box, stage: Stage | None, frame: int, letter: int
) -> None:
    if stage is None:
        return
    picture.paste(stage.picture(frame), (box.left, box.top))
    if not stage.seen(frame):
        away(pen, box, stage, frame, letter)


def _names(
    pen: ImageDraw.ImageDraw, scene: Scene, figures: Sequence[Figure], box: Box, letter: int
) -> None:
    """Who is in a row, with the mean error, in the margin."""
    bold, letters, line = font(letter, bold=True), font(letter - 1), round(1.4 * letter)
    top = float(box.top + letter // 2)
    colour_of = dict(zip(scene.figures, colours(scene), strict=True))
    for figure in figures:
        chip(pen, box.left, top, letter, colour_of[figure])
        top += line
        for words in wrapped(plain(figure.label).replace("[", " ["), bold, box.width, 3):
            pen.text((box.left, top), words, INK, bold)
            top += line
        if figure.error is not None:
            words = f"error {float(np.nanmean(figure.error)):.1f} %"
            pen.text((box.left, top), short(words, letters, box.width), FAINT, letters)
            top += line
        top += line // 2
