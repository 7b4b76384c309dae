"""How much a validation part of windows flatters: HuMoT's reconstruction error on three kinds of windows.

    bench train 'humot[split=chunk]' -d 'puppets[size=default]' --out runs/train/chunk
    python tests/benchmarks/humot_leak.py runs/train/chunk [--dataset DATASET] [--windows N]

(a) windows that were trained on; (b) windows of the same clips that were not, which is the paper's
validation: four fifths of each are in windows beside it, most of which were trained on; (c) windows of
clips that were never trained on, by the same characters: from the data set's validation part. The leak is
c - b: by how much the error on new motion is larger than such a validation says. Every character with
windows of all three kinds gives as many of each, and beside each window of (b) stands one of (a) from its
own clip.

Errors are distances of a body's joints in cm, mean over frames, joints, windows of a clip, and clips;
intervals are over clips (``retarget_bench/analysis/statistics.py``), those of differences by
bootstrap, paired where the clips are the same. ``still`` is the error of each window's mean pose: how much
there is to be told.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from tqdm import tqdm

from retarget_bench.analysis.statistics import LEVEL, mean_intervals
from retarget_bench.api import SPLITS, Context, Dataset, optional
from retarget_bench.errors import BenchError
from retarget_bench.methods.humot.features import body
from retarget_bench.methods.humot.training import held_out
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import weights
from retarget_bench.training.clips import training_clips
from retarget_bench.training.data import ClipArrays

KINDS = ("trained on", "held out of the same clips", "of clips never trained on")
RESAMPLES = 10_000
AT_ONCE = 64


@dataclass(frozen=True, eq=False)
class Window:
    """motion: its frames alone, at the recipe's rate. clip: the unit of the statistics."""

    clip: str
    motion: Motion


@dataclass(frozen=True)
class Cut:
    """How windows were cut for training."""

    frames: int
    hop: int
    fps: float

    def starts(self, clip: ClipArrays) -> range:
        return clip.starts(self.frames, self.hop)

    def of(self, name: str, motion: Motion, start: int) -> Window:
        return Window(name, motion.at(slice(start, start + self.frames)))


def known(name: str, character: str, motion: Motion) -> ClipArrays:
    """A clip as training knows it, by its number of frames alone."""
    return ClipArrays(character, name, {"frames": np.zeros(motion.frames)})


def both(
    clips: Any, character: str, cut: Cut, count: int, draw: np.random.Generator
) -> Iterator[tuple[Window, Window]]:
    """(a) and (b): pairs of a window trained on and one held out, of the same clip."""
    listed = []
    for number in range(len(clips)):
        motion = clips[number].resample(cut.fps)
        clip = known(clips.names[number], character, motion)
        every = cut.starts(clip)
        aside = held_out(clip, every)
        listed += [(clip, motion, start, sorted(set(every) - aside)) for start in sorted(aside)]
    for at in draw.permutation(len(listed))[:count]:
        clip, motion, start, rest = listed[at]
        name = f"{character}/{clip.name}"
        yield cut.of(name, motion, int(draw.choice(rest))), cut.of(name, motion, start)


def never(data: Dataset) -> Mapping[str, Mapping[str, Motion]]:
    """Character -> clip -> motion, of the validation part."""
    found: dict[str, dict[str, Motion]] = defaultdict(dict)
    listed = [info for split in SPLITS for info in data.cases("retarget", split)]
    for info in tqdm(listed, desc="validation", leave=False):
        case = data.load(info)
        for name, motion in ((info.source, case.source), (info.target, case.reference)):
            if isinstance(motion, Motion):
                found[name].setdefault(info.clip, motion)
    return found


def new(clips: Mapping[str, Motion], cut: Cut, count: int, draw: np.random.Generator) -> Iterator[Window]:
    """(c) of one character."""
    motions = {name: motion.resample(cut.fps) for name, motion in clips.items()}
    listed = [
        (name, start)
        for name, motion in motions.items()
        if motion.frames >= cut.frames
        for start in cut.starts(known(name, "", motion))
    ]
    for at in draw.permutation(len(listed))[:count]:
        name, start = listed[at]
        yield cut.of(name, motions[name], start)


def drawn(data: Dataset, method: Any, cut: Cut, count: int) -> list[list[Window]]:
    """The three kinds. Raises BenchError where no character has all of them."""
    part = optional.validation(data)
    if part is None:
        raise BenchError(f"{data.label} has no validation part: no clips that were never trained on")
    others, draw = never(part), np.random.default_rng(0)
    found: list[list[Window]] = [[], [], []]
    cast = {name: clips for mine in training_clips(data).values() for name, clips in mine.items()}
    names = [name for name in sorted(set(cast) & set(others)) if not method.unfit(data.characters()[name])]
    for name in tqdm(names, desc="training motion", leave=False):
        pairs = both(cast[name], name, cut, count, draw)
        for (seen, aside), fresh in zip(pairs, new(others[name], cut, count, draw), strict=False):
            for kind, window in zip(found, (seen, aside, fresh), strict=True):
                kind.append(window)
    if not found[0]:
        raise BenchError(f"{data.label}: no character has windows of all three kinds")
    return found


def errors(method: Any, windows: Sequence[Window]) -> dict[str, tuple[float, float]]:
    """Clip -> mean error of its windows in cm, and that of their mean poses."""
    found = defaultdict(list)
    for start in tqdm(range(0, len(windows), AT_ONCE), desc="windows", leave=False):
        some = windows[start : start + AT_ONCE]
        asked = [window.motion for window in some]
        cast = [motion.character for motion in asked]
        answers = method.retarget_batch(asked, cast, contexts=[Context()] * len(some))
        for window, answer in zip(some, answers, strict=True):
            joints = list(body(window.motion.character).joints)
            right = window.motion.positions[:, joints]
            off = [answer.positions[:, joints] - right, right.mean(axis=0) - right]
            found[window.clip].append([100.0 * float(np.linalg.norm(each, axis=-1).mean()) for each in off])
    return {clip: tuple(np.mean(each, axis=0)) for clip, each in sorted(found.items())}


def difference(more: Mapping[str, Any], less: Mapping[str, Any]) -> tuple[float, float, float]:
    """Difference of mean errors over clips, and the ends of its interval."""
    draw = np.random.default_rng(0)
    one, two = (np.array(list(each.values()))[:, 0] for each in (more, less))
    first = draw.integers(len(one), size=(RESAMPLES, len(one)))
    paired = list(more) == list(less)
    second = first if paired else draw.integers(len(two), size=(RESAMPLES, len(two)))
    spread = one[first].mean(axis=1) - two[second].mean(axis=1)
    ends = np.quantile(spread, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(one.mean() - two.mean()), float(ends[0]), float(ends[1])


def told(path: str) -> tuple[Mapping[str, Any], Any, Cut]:
    """The card, the method and its windows. Raises BenchError for weights of the other split."""
    card = weights.read_card(path)
    facts, config = card["facts"], card["recipe"]
    if card["method"] != "humot" or facts.get("split") != "chunk":
        raise BenchError(f"{path}: these weights were not trained with humot[split=chunk]; all were seen")
    method = bound.method(Spec("humot", {**facts, "weights": path})).built
    return card, method, Cut(int(config["window"]), int(facts["hop"]), float(config["fps"]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weights")
    parser.add_argument("-d", "--dataset", help="with its places; that of the card unless told")
    parser.add_argument("--windows", type=int, default=32, help="of each kind of each character")
    given = parser.parse_args()
    card, method, cut = told(given.weights)
    data = bound.dataset(Spec.parse(given.dataset or card["data"]["spec"])).built
    if data.content != card["data"]["content"]:
        raise BenchError(f"{data.label} is not what these weights were trained on: {card['data']['label']}")
    groups = drawn(data, method, cut, given.windows)
    found = [errors(method, windows) for windows in groups]
    print(f"{data.label}: {card['step']} steps; cm, {100 * LEVEL:.0f} % intervals over clips")
    for kind, windows, clips in zip(KINDS, groups, found, strict=True):
        each, still = np.array(list(clips.values())).T
        interval = mean_intervals(each[None])[0]
        ends = f"{interval.low:.3f} to {interval.high:.3f}" if interval else "too few clips"
        counts = f"{len(windows):6} windows {len(clips):4} clips"
        print(f"{kind:28}{counts}{each.mean():8.3f}  {ends}   still {still.mean():.2f}")
    for name, one, two in (("validation less training", 1, 0), ("leak", 2, 1)):
        mean, low, high = difference(found[one], found[two])
        print(f"{name:52}{mean:8.3f}  {low:.3f} to {high:.3f}")


if __name__ == "__main__":
    main()
