"""The choice of changes, their amounts, and the windows of a batch that get them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from retarget_bench.motion.character import Motion
from retarget_bench.motion.roles import BODY_PARTS
from retarget_bench.training.augmentation.body import AugmentedBody
from retarget_bench.training.augmentation.windows import MotionWindows, side_by_side
from retarget_bench.training.config import Augmentation

SECONDS, VEERING = 0.5, 1.0
"""Between the independent numbers that smooth noise is made of; of turns of the path."""
PART = 0.5
"""How often a row with parts of another takes each of them over."""


@dataclass(frozen=True, eq=False)
class ClipWindow:
    """A window that was drawn.

    rotations: ``(frames of the clip, joints, 4)`` in aligned form. root: ``(frames of the clip, 3)``.
    start: the window's first frame. length: its real frames.
    """

    body: AugmentedBody
    rotations: np.ndarray
    root: np.ndarray
    start: int
    length: int


@dataclass(frozen=True, eq=False)
class Augmenter:
    """shares: what is done, how often, by how much. fps: of all clips. prepare: a method's, of a motion."""

    shares: Augmentation
    fps: float
    prepare: Callable[[Motion], Mapping[str, np.ndarray]]

    def changed(
        self, numbers: np.random.Generator, drawn: Sequence[ClipWindow], warping: bool
    ) -> dict[int, Mapping[str, np.ndarray]]:
        """Row -> what the method sees of it, ``(length, ...)``, for the rows that are changed.

        warping: whether windows may have frames before and behind those that were drawn.
        """
        configured, rows = self.shares, len(drawn)
        names = ("exchanged", "turned", "mirrored", "warped", "veered")
        shares = np.array([getattr(configured, name) for name in names])
        exchanged, turned, mirrored, warped, veered = numbers.random((5, rows)) < shares[:, None]
        lengths = np.array([each.length for each in drawn])
        mirrored &= [each.body.mirror is not None for each in drawn]
        warped &= warping
        before = self._read(numbers, drawn, warped)
        partners = (np.arange(rows) + numbers.integers(1, max(rows, 2), size=rows)) % rows
        exchanged &= lengths[partners] >= lengths
        parts = (numbers.random((rows, len(BODY_PARTS))) < PART) & exchanged[:, None]
        windows = self._turned(numbers, before.exchanged(partners, parts), turned)
        windows = windows.as_low_as(before).mirrored(np.flatnonzero(mirrored))
        noise = smooth_noise(numbers, (rows,), windows.root.shape[1], self.fps, VEERING)
        windows = windows.veered(np.radians(configured.veer) * veered[:, None] * noise)
        return {
            row: self.prepare(windows.motion(row, int(lengths[row]), self.fps))
            for row in np.flatnonzero(exchanged | turned | mirrored | warped | veered).tolist()
        }

    def _read(
        self, numbers: np.random.Generator, drawn: Sequence[ClipWindow], warped: np.ndarray
    ) -> MotionWindows:
        """The windows, at other speeds where ``warped`` ``(rows,)`` says so."""
        frames = max(each.length for each in drawn)
        largest = np.log(self.shares.speed)
        noise = smooth_noise(numbers, (len(drawn),), frames, self.fps)
        speeds = np.exp((0.5 * largest * noise).clip(-largest, largest))
        passed = np.cumsum(speeds, axis=1) - speeds[:, :1]
        windows = []
        for number, one in enumerate(drawn):
            at = one.start + np.arange(frames, dtype=np.float64)
            if warped[number]:
                at = placed(passed[number], one.start, one.length, len(one.root))
            windows.append((one.rotations, one.root, at.clip(max=len(one.root) - 1)))
        return side_by_side([each.body for each in drawn], windows)

    def _turned(
        self, numbers: np.random.Generator, windows: MotionWindows, turned: np.ndarray
    ) -> MotionWindows:
        """Some chains of the rows that are ``turned`` ``(rows,)`` turned smoothly about random axes."""
        counts = [len(body.links) for body in windows.bodies]
        chosen = numbers.random(sum(counts)) < self.shares.joints
        chains = np.flatnonzero(chosen & np.repeat(turned, counts))
        size = np.radians(self.shares.deviation) / np.sqrt(3.0)  # of each of three numbers
        noise = smooth_noise(numbers, (len(chains), 3), windows.root.shape[1], self.fps)
        return windows.turned(chains, size * noise.transpose(2, 0, 1))


def placed(passed: np.ndarray, start: int, length: int, frames: int) -> np.ndarray:
    """``(frames,)`` when in a clip each frame of a window is, from what has ``passed`` since its first.

    The window begins at ``start``, or earlier where its ``length`` frames would not end in the clip of
    ``frames`` frames; where they do not even fit into the whole of it, all is slower.
    """
    last = passed[length - 1]
    if last > frames - 1:
        return passed * ((frames - 1) / last)
    return min(start, frames - 1 - last) + passed


def smooth_noise(
    numbers: np.random.Generator, shape: tuple[int, ...], frames: int, fps: float, every: float = SECONDS
) -> np.ndarray:
    """``(*shape, frames)`` normally distributed numbers that change within about twice ``every`` seconds.

    Gaussians about knots, weighted such that the deviation is 1 in every frame.
    """
    seconds = np.arange(frames) / fps
    knots = every * np.arange(-2, int(seconds[-1] / every) + 4)
    weights = np.exp(-0.5 * ((seconds - knots[:, None]) / every) ** 2)
    weights /= np.linalg.norm(weights, axis=0)
    return numbers.standard_normal((*shape, len(knots))) @ weights
