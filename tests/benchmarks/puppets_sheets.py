"""Contact sheets of the puppets: every kind of performance by three bodies, as pictures.

    python tests/benchmarks/puppets_sheets.py OUT [--kinds walk,wave] [--people ada,pip,vesper]
        [--dogs rex,waldi,biscuit] [--frames 8] [--seconds 4] [--azimuth -50] [--height 110] [--clip NAME]

in an environment in which retarget-bench and Pillow are installed. Writes ``OUT/KIND.png``: a row for each
body, time from left to right. Bodies are drawn with their skins, left limbs lighter; a dash below a foot
says that its ankle (or, lower, its toe joint; of dogs hind or fore paw) rests. Figures are centred on their
pelvis, so that travel does not show; on stairs they are drawn standing on their lower foot.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from retarget_bench.datasets.puppets.bodies import rigs
from retarget_bench.datasets.puppets.bodies.structures import Body
from retarget_bench.datasets.puppets.conventions import FPS
from retarget_bench.datasets.puppets.corpus.families import Family, families
from retarget_bench.datasets.puppets.randomness import Stream
from retarget_bench.motion.mesh import Mesh

FINE = 3
"""Drawn so many times as large, then reduced."""
LIGHT = np.array([0.35, 0.8, 0.5])
SKINS = ((205, 140, 105), (120, 155, 120), (125, 140, 190))
PAPER, FLOOR, MARK = (255, 255, 255), (205, 205, 205), (60, 60, 60)


def camera(azimuth: float) -> np.ndarray:
    """``(3, 3)`` rows: right, up and towards the viewer; at 0 the body is seen from its front."""
    a = np.radians(azimuth)
    return np.array([[np.cos(a), 0.0, -np.sin(a)], [0.0, 1.0, 0.0], [np.sin(a), 0.0, np.cos(a)]])


def tinted(mesh: Mesh, colour: tuple[int, int, int], lefts: list[int]) -> np.ndarray:
    """``(faces, 3)`` colours: left limbs lighter."""
    share = mesh.weights[:, lefts].sum(axis=1)[mesh.faces].mean(axis=1)[:, None]
    return np.array(colour) * (1.0 - share) + (0.45 * np.array(colour) + 140.0) * share


def draw(
    canvas: ImageDraw.ImageDraw,
    points: np.ndarray,
    faces: np.ndarray,
    colours: np.ndarray,
    view: np.ndarray,
    origin: tuple[float, float],
    scale: float,
) -> None:
    """One figure: ``points`` ``(vertices, 3)`` metres from what is drawn at ``origin``."""
    seen = points @ view.T
    corners = seen[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    bright = 0.5 + 0.5 * np.clip(normal @ LIGHT, 0.0, 1.0)
    flat = np.stack([origin[0] + scale * corners[..., 0], origin[1] - scale * corners[..., 1]], axis=-1)
    front = np.flatnonzero(normal[:, 2] > 0.0)
    for face in front[np.argsort(corners[front, :, 2].mean(axis=1))]:
        fill = tuple(int(c) for c in colours[face] * bright[face])
        canvas.polygon([tuple(point) for point in flat[face]], fill=fill)


class Figure:
    """A body's performance, ready to be drawn frame by frame."""

    def __init__(self, family: Family, body: Body, score: object, colour: tuple[int, int, int]) -> None:
        solution = family.solve(score, body)
        who = rigs.character(body)
        assert who.mesh is not None
        motion = who.motion(rigs.rotations(solution.orientations, body, who), solution.root, FPS)
        self.planted, self.mesh = solution.planted, who.mesh
        skin = who.mesh.skinned(motion)
        self.dog = family.name == "dogs"
        middle = skin.mean(axis=1) if self.dog else np.array(solution.root)
        middle[:, 1] = skin[..., 1].min(axis=1) if getattr(score, "stairs", None) else 0.0
        self.points = skin - middle[:, None]
        lefts = [joint for joint, part in enumerate(body.structure.parts) if part.startswith("left")]
        self.colours = tinted(who.mesh, colour, [joint for joint in lefts if joint < len(who.skeleton)])
        self.tall = float(np.ptp(who.mesh.vertices[:, 1]))


def sheet(figures: list[Figure], frames: np.ndarray, azimuth: float, height: int) -> Image.Image:
    """Rows of figures; each row's body fills ``height`` pixels when it stands."""
    view, high = camera(azimuth), height * FINE
    step, row = int((1.7 if figures[0].dog else 0.85) * high), int(1.32 * high)
    picture = Image.new("RGB", (step * len(frames), row * len(figures)), PAPER)
    canvas = ImageDraw.Draw(picture)
    for rank, figure in enumerate(figures):
        base = row * (rank + 1) - 0.10 * high
        canvas.line([(0, base), (picture.width, base)], fill=FLOOR, width=FINE)
        for column, frame in enumerate(frames):
            x = step * (column + 0.5)
            scale = high / figure.tall
            draw(canvas, figure.points[frame], figure.mesh.faces, figure.colours, view, (x, base), scale)
            # columns: ankle and toe joint, left and right; of dogs hind and fore paws, left and right
            for foot, resting in enumerate(figure.planted[frame]):
                if resting:
                    side, second = (foot % 2, foot // 2) if figure.dog else (foot // 2, foot % 2)
                    left = x + high * (-0.14 if side else 0.08)
                    y = base + high * (0.03 + 0.03 * second)
                    canvas.line([(left, y), (left + 0.06 * high, y)], fill=MARK, width=FINE)
    return picture.resize((picture.width // FINE, picture.height // FINE), Image.Resampling.LANCZOS)


def chosen(family: Family, options: argparse.Namespace) -> list[Body]:
    named = options.people if family.name == "people" else options.dogs
    return [family.bodies[name] for name in named.split(",")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--kinds", default="")
    parser.add_argument("--people", default="ada,pip,vesper")
    parser.add_argument("--dogs", default="rex,waldi,biscuit")
    parser.add_argument("--clip", default="sheet")
    for name, usual in (("frames", 8), ("height", 110)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    for name, usual in (("seconds", 4.0), ("start", 0.0), ("azimuth", -50.0)):
        parser.add_argument(f"--{name}", type=float, default=usual)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for family in families():
        bodies = chosen(family, options)
        for kind in family.kinds:
            if options.kinds and kind not in options.kinds.split(","):
                continue
            score = family.kinds[kind](Stream("puppets", options.clip, kind), round(options.seconds * FPS))
            figures = [
                Figure(family, body, score, skin) for body, skin in zip(bodies, SKINS * 2, strict=False)
            ]
            last = round(options.seconds * FPS) - 1
            frames = np.linspace(options.start * FPS, last, options.frames).round().astype(int)
            picture = sheet(figures, frames, options.azimuth, options.height)
            place = options.out / f"{kind}.png"
            picture.quantize(40).save(place, optimize=True)
            print(place, f"{place.stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    main()
