"""The picture at the top of README.md: a throw by one body, retargeted to another by four methods.

    python benchmarks/readme_picture.py [-o docs/pictures/throw.png]

Asks the methods for a case of the puppets (default size), as ``bench render --ask`` does, and draws one
frame of all figures in a row at one scale, with labels that stay readable at half the size. Case, frame and
methods are fixed below.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from retarget_bench.commands.render import Options, scene_of
from retarget_bench.viewer.colours import FAINT, INK, PAPER, colours
from retarget_bench.viewer.drawing import GAP, draw_chip
from retarget_bench.viewer.renderer import DrawingStyle, stages
from retarget_bench.viewer.scene import Figure
from retarget_bench.viewer.text import font

OUTPUT = Path(__file__).parents[1] / "docs" / "pictures" / "throw.png"
DATASET = "puppets[size=default]"
CASE = "ada>boulder/throw-101"
"""Bodies of different structure, size and build, limbs far from the trunk, and a wide step."""
METHODS = ("ik", "copy_rotations", "humot", "pan")
FRAME = 62
VIEW = "three-quarter"
PANEL = (300, 366)
"""Pixels of a figure's panel."""
LETTER = 28
"""Pixels of the letters; pages show the picture at about half its size."""


def described(figure: Figure) -> str:
    """The second line below a figure: who it is, or its mean distance from the reference over the clip."""
    if figure.error is None or figure.part != "prediction":
        return figure.character.name
    return f"MPJPE {float(np.nanmean(figure.error)):.1f} %"


def drawn() -> Image.Image:
    scene = scene_of([CASE], Options(out=OUTPUT, dataset=DATASET, methods=METHODS, ask=True))
    wide, high = PANEL
    style = DrawingStyle(PANEL, VIEW)
    picture = Image.new("RGB", (len(scene.figures) * (wide + GAP) - GAP, high + round(2.9 * LETTER)), PAPER)
    pen = ImageDraw.Draw(picture)
    images = stages(scene, style, [FRAME - 1], PANEL)
    for number, (figure, colour, stage) in enumerate(
        zip(scene.figures, colours(scene), images, strict=True)
    ):
        if stage is None:
            sys.exit(f"{figure.label}: {figure.status}, {figure.message}")
        left, top = number * (wide + GAP), high + 0.4 * LETTER
        picture.paste(stage.picture(FRAME - 1), (left, 0))
        draw_chip(pen, left, top + 0.15 * LETTER, LETTER, colour)
        pen.text((left + 1.95 * LETTER, top), figure.label, INK, font(LETTER, bold=True))
        pen.text((left, top + 1.35 * LETTER), described(figure), FAINT, font(LETTER - 2))
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    image = drawn()
    options.output.parent.mkdir(parents=True, exist_ok=True)
    image.save(options.output, optimize=True)
    print(
        f"{options.output}: {image.width} x {image.height}, {options.output.stat().st_size / 1000:.0f} kB"
    )


if __name__ == "__main__":
    main()
