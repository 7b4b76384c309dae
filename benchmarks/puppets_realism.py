"""Puppets of both versions beside recorded people: straight limbs, resting feet, quick hands.

    python benchmarks/puppets_realism.py cmu=DIR lafan1=DIR

in an environment in which retarget-bench is installed; each DIR has BVH files of whole bodies. The puppets
are the people of ``puppets[size=tiny]``, split self. All at 30 frames per second, cut into pieces of four
seconds; pieces under a second are left out.

knee, elbow: degrees between its bones, 0 straight: the least, the 1st and the 10th percentile of all
frames, and the median of each piece's and side's least. foot: speed of the ankles, leg lengths a second:
median of all frames, and of those slower than the limit of contacts by speed. hand: share of the energy of
the wrist's velocity, under a Hann window, above 6 Hz, in per cent: mean and median of pieces and sides.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import get_args

import numpy as np

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.contract import Version
from retarget_bench.motion.contact import planted
from retarget_bench.motion.importer import load
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import SIDES

FPS = 30.0
PIECE, SHORTEST = 120, 30
"""Frames."""
QUICK = 6.0
"""Hertz."""
LIMBS = {"knee": ("up_leg", "leg", "foot"), "elbow": ("arm", "forearm", "hand")}
COLUMNS = (
    "pieces",
    *(f"{limb}: {what}" for limb in LIMBS for what in ("least", "1 %", "10 %", "least of a piece, median")),
    "foot: all frames",
    "foot: resting",
    "hand: mean",
    "hand: median",
)


def made(version: Version) -> Iterator[Motion]:
    data = Puppets(version=version)
    for info in data.cases("retarget", "self"):
        if not data.characters()[info.source].four_legged:
            yield data.motion(info.clip, info.source)


def recorded(folder: Path) -> Iterator[Motion]:
    for path in sorted(folder.glob("*.bvh")):
        yield load(path, fps=FPS).motion


def pieces(motions: Iterable[Motion]) -> Iterator[Motion]:
    """Pieces of those that have the joints that are measured."""
    needed = {f"{side}_{part}" for side in SIDES for parts in LIMBS.values() for part in parts}
    for motion in motions:
        if needed <= set(motion.character.joint_of):
            for first in range(0, motion.frames - SHORTEST + 1, PIECE):
                yield motion.at(slice(first, first + PIECE))


def bend(motion: Motion, side: str, parts: tuple[str, str, str]) -> np.ndarray:
    """``(frames,)`` degrees."""
    top, middle, end = (motion.positions[:, motion.character.joint_of[f"{side}_{part}"]] for part in parts)
    upper, lower = middle - top, end - middle
    across = np.linalg.norm(np.cross(upper, lower), axis=-1)
    return np.degrees(np.arctan2(across, (upper * lower).sum(axis=-1)))


def quick(path: np.ndarray) -> float:
    """The share, in per cent, of the velocity's energy above ``QUICK`` of a joint's positions
    ``(frames, 3)``."""
    velocity = np.diff(path, axis=0)
    velocity = (velocity - velocity.mean(axis=0)) * np.hanning(len(velocity))[:, None]
    energy = (np.abs(np.fft.rfft(velocity, axis=0)) ** 2).sum(axis=1)
    above = np.fft.rfftfreq(len(velocity), 1.0 / FPS) > QUICK
    return 100.0 * float(energy[above].sum() / max(energy.sum(), 1e-30))


def row(motions: Iterable[Motion]) -> list[float]:
    """The values of ``COLUMNS``."""
    bends: dict[str, list[np.ndarray]] = {limb: [] for limb in LIMBS}
    speeds, resting, shares, number = [], [], [], 0
    for piece in pieces(motions):
        joint, number = piece.character.joint_of, number + 1
        for side in SIDES:
            for limb, parts in LIMBS.items():
                bends[limb].append(bend(piece, side, parts))
            foot = piece.positions[:, [joint[f"{side}_foot"]]]
            leg = piece.character.measures.leg_length
            speed = np.linalg.norm(np.diff(foot[:, 0], axis=0), axis=-1) * FPS / leg
            speeds.append(speed)
            resting.append(speed[planted(foot, piece.character.height, FPS)[1:, 0]])
            shares.append(quick(piece.positions[:, joint[f"{side}_hand"]]))
    values = [float(number)]
    for each in bends.values():
        values += np.percentile(np.concatenate(each), (0, 1, 10)).tolist()
        values.append(float(np.median([angles.min() for angles in each])))
    values += [float(np.median(np.concatenate(each))) for each in (speeds, resting)]
    return [*values, float(np.mean(shares)), float(np.median(shares))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", nargs="*", metavar="NAME=DIR")
    options = parser.parse_args()
    folders = dict(text.partition("=")[::2] for text in options.recordings)
    for name, folder in folders.items():
        if not folder or next(Path(folder).glob("*.bvh"), None) is None:
            parser.error(f"{name}={folder}: give NAME=DIR, where DIR has BVH files")
    rows = {f"puppets-{version}": row(made(version)) for version in get_args(Version)}
    rows |= {name: row(recorded(Path(folder))) for name, folder in folders.items()}
    print(f"| | {' | '.join(rows)} |\n|---{'|---' * len(rows)}|")
    for column, *values in zip(COLUMNS, *rows.values(), strict=True):
        print(f"| {column} | {' | '.join(f'{value:.3f}'.rstrip('0').rstrip('.') for value in values)} |")


if __name__ == "__main__":
    main()
