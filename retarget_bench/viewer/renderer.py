"""Figures on a floor seen by one camera, as a picture of any frame."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

from retarget_bench.api import Ground
from retarget_bench.errors import BenchError
from retarget_bench.viewer import floor
from retarget_bench.viewer.bodies import Piece, Solid
from retarget_bench.viewer.camera import VIEWS, Camera, axes, fitted, stays, track
from retarget_bench.viewer.colours import CONTACT, STAGE, STRIPE, colours, shade
from retarget_bench.viewer.scene import Scene

Following = Literal["auto", "fit", "follow"]

SMALLEST, LARGEST = 16, 8192
"""Pixels of a picture's side."""
THIN = 0.6
"""Thickness of bones in an overlay, where they hide each other; usually 1."""
FINER = 2
"""Pictures are drawn this many times larger and averaged, so that edges are smooth."""
SAMPLE = 60
"""Frames that are looked at to fit a camera."""
ASTRAY = 0.7
"""Heights: what strays farther from what it should follow need not be in the picture."""
PAD, SKIN_PAD = 0.1, 0.18
"""Heights that are left free around joints, which bodies are thicker than, and skins go beyond."""
BALL = 0.014
"""Radius of the mark on a joint that rests, in heights."""
STRIPES = 6
"""Pixels from one stripe to the next, on what is lit."""
REACH = 2.6
"""Radius of the drawn floor, in heights, at least."""


@dataclass(frozen=True)
class DrawingStyle:
    """Options of a drawn scene.

    size: width and height, pixels. view: one of ``VIEWS``. overlay: all figures in one panel.
    skin: with skins, where bodies have one. camera: ``fit`` stands still, ``follow`` goes along; ``auto``
    follows figures that go far.

    Raises BenchError for an unknown view or a size that cannot be drawn.
    """

    size: tuple[int, int] = (1280, 720)
    view: str = "three-quarter"
    overlay: bool = False
    skin: bool = False
    camera: Following = "auto"

    def __post_init__(self) -> None:
        if not all(SMALLEST <= side <= LARGEST for side in self.size):
            raise BenchError(
                f"a picture of {self.size[0]} x {self.size[1]} pixels cannot be drawn; each side has "
                f"{SMALLEST} to {LARGEST}"
            )
        if self.view not in VIEWS:
            raise BenchError(f"there is no view {self.view!r}; views are {', '.join(VIEWS)}")


@dataclass(frozen=True, eq=False)
class Stage:
    """Figures that one camera sees.

    targets: ``(frames, 3)`` metres, the points of the floor that it looks at. size: pixels.
    """

    solids: tuple[Solid, ...]
    ground: Ground
    camera: Camera
    targets: np.ndarray
    size: tuple[int, int]
    _pictures: dict[tuple[float, ...], Image.Image] = field(default_factory=dict)

    def picture(self, frame: int) -> Image.Image:
        """An RGB picture of a frame."""
        size = self.size[0] * FINER, self.size[1] * FINER
        camera, target = self._fine, self.targets[frame]
        picture = self._ground((float(target[0]), float(target[1]), float(target[2]))).copy()
        pen = ImageDraw.Draw(picture)
        height = float(self.ground.height)
        if self.ground.heights is None:
            for solid in self.solids:
                floor.shadows(pen, solid, frame, height, camera, target)
        for solid in self.solids:
            floor.halos(pen, solid, frame, self.ground, camera, target)
        pieces = [piece for solid in self.solids for piece in self._pieces(solid, frame, size)]
        for piece in sorted(pieces, key=lambda piece: -piece.depth):
            pen.polygon(piece.corners, fill=piece.colour)
        lit = [
            each
            for solid in self.solids
            for each in solid.lit_pieces(frame, self._fine, self.targets[frame], size)
        ]
        return (_striped(picture, lit) if lit else picture).reduce(FINER)

    def _ground(self, target: tuple[float, float, float]) -> Image.Image:
        """The floor around where the camera looks; kept as long as it does not move."""
        if target not in self._pictures:
            size = self.size[0] * FINER, self.size[1] * FINER
            picture = Image.new("RGB", size, STAGE)
            reach = max(
                REACH * max(solid.size for solid in self.solids), 0.75 * max(size) / self._fine.zoom
            )
            floor.draw(ImageDraw.Draw(picture), self.ground, self._fine, np.array(target), reach)
            self._pictures.clear()
            self._pictures[target] = picture
        return self._pictures[target]

    @cached_property
    def _fine(self) -> Camera:
        camera = self.camera
        centre = camera.centre[0] * FINER, camera.centre[1] * FINER
        return replace(camera, zoom=camera.zoom * FINER, centre=centre)

    def _pieces(self, solid: Solid, frame: int, size: tuple[int, int]) -> list[Piece]:
        pieces = solid.pieces(frame, self._fine, self.targets[frame], size)
        for place in floor.resting(solid, frame):
            (across, down), depth, scale = self._fine.project(place, self.targets[frame])
            circle = np.stack([np.cos(floor.CORNERS), np.sin(floor.CORNERS)], axis=1)
            ball = (BALL * solid.size * scale) * circle
            near = float(depth) - 0.06 * solid.size  # over the foot that it is in
            for share, colour in ((1.25, shade(CONTACT, 0.35)), (1.0, CONTACT)):
                corners = share * ball + np.array([across, down])
                pieces.append(Piece(near, corners.ravel().tolist(), colour))
        return pieces

    def in_picture(self, frame: int) -> bool:
        """True where any joint of the first figure is in the picture."""
        pixels = self.camera.project(self.solids[0].places[frame], self.targets[frame])[0]
        return bool(((pixels >= 0) & (pixels <= np.array(self.size))).all(axis=1).any())


def _striped(picture: Image.Image, lit: list[Piece]) -> Image.Image:
    """A picture with pieces over all that is in it, striped and with a rim."""
    mask = Image.new("L", picture.size)
    canvas, marks = ImageDraw.Draw(picture), ImageDraw.Draw(mask)
    for piece in lit:
        marks.polygon(piece.corners, fill=255)
    picture.paste(STRIPE, mask=mask.filter(ImageFilter.MaxFilter(2 * FINER + 1)))
    for piece in sorted(lit, key=lambda piece: -piece.depth):
        canvas.polygon(piece.corners, fill=piece.colour)
    across, down = np.meshgrid(np.arange(picture.size[0]), np.arange(picture.size[1]))
    dark = (across + down) % (STRIPES * FINER) < STRIPES * FINER // 3
    picture.paste(STRIPE, mask=Image.fromarray(np.where(dark, np.asarray(mask), 0).astype(np.uint8)))
    return picture


def stages(
    scene: Scene, style: DrawingStyle, frames: Sequence[int], size: tuple[int, int]
) -> list[Stage | None]:
    """A stage of a size for every figure, all at one scale, None where there is nothing to draw; overlaid,
    one for all.

    Cameras look at the reference where there is one, so that figures elsewhere are seen to be elsewhere.
    frames: those that will be drawn.
    """
    solids = [
        Solid(figure, colour, style.skin, THIN if style.overlay else 1.0)
        if figure.positions is not None
        else None
        for figure, colour in zip(scene.figures, colours(scene), strict=True)
    ]
    drawn = [solid for solid in solids if solid is not None]
    reference = next((solid for solid in drawn if solid.figure.part == "reference"), None)
    groups = [drawn] if style.overlay else [[solid] for solid in drawn]
    leads = [
        reference if reference and (style.overlay or group[0].figure.part == "prediction") else group[0]
        for group in groups
    ]
    follow = style.camera == "follow" or (
        style.camera == "auto" and not all(stays(_root(lead)[list(frames)], lead.size) for lead in leads)
    )
    sample = list(frames[:: 1 + (len(frames) - 1) // SAMPLE])
    targets, shots = [], []
    for group, lead in zip(groups, leads, strict=True):
        way = _root(lead) if follow else _root(lead)[list(frames)]
        aim = track(way, float(scene.ground.height), scene.fps, follow)
        aim = aim if follow else np.repeat(aim[:1], len(lead.places), axis=0)
        targets.append(aim)
        shots.append(
            (axes(style.view, lead.body, lead.places[frames[0]]), _around(group, lead, sample, aim))
        )
    pad = SKIN_PAD if any(solid.skinned for solid in drawn) else PAD
    cameras = fitted(shots, pad * max(lead.size for lead in leads), size)
    built = (
        Stage(tuple(group), scene.ground, camera, aim, size)
        for group, camera, aim in zip(groups, cameras, targets, strict=True)
    )
    return list(built) if style.overlay else [None if solid is None else next(built) for solid in solids]


def _root(solid: Solid) -> np.ndarray:
    """``(frames, 3)`` the hips, or the first joint."""
    return solid.places[:, solid.body.joint_of.get("hips", 0)]


def _around(group: Sequence[Solid], lead: Solid, frames: list[int], targets: np.ndarray) -> np.ndarray:
    """``(n, 3)`` joints of a group relative to where its camera looks, and that point itself.

    What is far from the lead is left out, so that a figure that flies off does not make the others tiny.
    """
    offsets = [np.zeros((1, 3))]
    home = _root(lead)[frames]
    for solid in group:
        near = np.linalg.norm(solid.extent[frames] - home[:, None], axis=-1) < ASTRAY * lead.size
        near |= solid is lead
        offsets.append((solid.extent[frames] - targets[frames][:, None])[near])
    points = np.concatenate(offsets)
    return points[np.isfinite(points).all(axis=1)]
