"""The report's figure of self-penetration: source, reference and answers at a few moments."""

import base64
import io
from dataclasses import dataclass, replace

import numpy as np
from PIL import Image

from retarget_bench.viewer import drawing
from retarget_bench.viewer.renderer import DrawingStyle
from retarget_bench.viewer.scene import Figure, Scene

ANSWERS = 3
"""Answers in the figure, those with the most self-penetration."""
MOMENTS = 5
SECONDS = 0.5
"""From the worst moment to the first and last that are shown."""
COLOURS = 128
"""Of the picture: it is a third as large with so few."""


@dataclass(frozen=True)
class PenetrationFigure:
    """A picture in the page. png: in base64. caption: says what is seen, also to those who cannot."""

    png: str
    caption: str


def penetration(scene: Scene) -> int:
    """Vertices of answers inside the body, all frames together, beyond those of the reference."""
    reference = sum(_count(each) for each in scene.figures if each.part == "reference")
    return max((_count(each) - reference for each in _answers(scene)), default=0)


def penetration_figure(scene: Scene) -> PenetrationFigure:
    """Source, reference and the answers with the most self-penetration, around the worst frame."""
    worst = _answers(scene)[:ANSWERS]
    figures = tuple(each for each in scene.figures if each in worst or each.part in ("source", "reference"))
    shown = replace(scene, figures=figures)
    lit = sum(each.inside.sum(axis=1) for each in worst if each.inside is not None)
    middle, reach = int(np.argmax(lit)), max(round(SECONDS * scene.fps), 1)
    first, last = max(middle - reach, 0), min(middle + reach, scene.frames - 1)
    frames = sorted({middle, *np.linspace(first, last, MOMENTS).round().astype(int).tolist()})
    style = DrawingStyle(drawing.usual_size(shown, len(frames), False), skin=True)
    picture = drawing.sheet(shown, style, frames).quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    written = io.BytesIO()
    picture.save(written, "PNG", optimize=True)
    names = ", ".join(each.label for each in worst)
    return PenetrationFigure(
        base64.b64encode(written.getvalue()).decode("ascii"),
        f"{scene.title}: flesh inside flesh of {names}, from {first / scene.fps:.2f} to "
        f"{last / scene.fps:.2f} s. Parts of forearms, hands, shanks and feet that are inside the rest of "
        "the body are striped in yellow and seen through it.",
    )


def _answers(scene: Scene) -> list[Figure]:
    """Answers with self-penetration, those with the most of it first."""
    answers = [each for each in scene.figures if each.part == "prediction" and _count(each)]
    return sorted(answers, key=_count, reverse=True)


def _count(figure: Figure) -> int:
    return 0 if figure.inside is None else int(figure.inside.sum())
