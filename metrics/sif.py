"""Source-instance fidelity: do answers of one kind differ from one another as their sources do?"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from retarget_bench.api import MetricCard, PairMetric, Value
from retarget_bench.api.comparison import Comparison, structure_joints
from retarget_bench.files import digest

SOURCE = (
    "Li et al., Why cross-skeleton retargeting is non-identifiable, NeurIPS 2026: SIF as their toolkit "
    "1.0.0 computes it, of groups that have also the target body in common"
)
GROUP = (
    "group: the answered clips of one kind by one pair of bodies, at least {least}; distance of clips "
    "i < j: mean over frames of the mean squared coordinate of what is left of j, each frame centred, when "
    "i is turned and scaled onto it as well as may be (no mirroring); {frames}; at the shortest clip"
)
RAW, FIXED = "of both clips their common first frames", "of each clip 64 frames, evenly, by lines between"
LEAST, LENGTH = 3, 64
"""Clips of a group; frames to which clips are brought to match."""
CONSTANT = 1e-8
"""Distances whose standard deviation is less never vary; the toolkit's."""
DRAWS, SEED = 10_000, 42
"""Of intervals and shuffle tests; the toolkit's."""
FACTS = 2
"""Columns of an extract beside joints: the kind of the clip, and the number of the source's joints."""
_value = partial(Value, source=SOURCE, needs=("source", "clips"))


class Sif(PairMetric):
    """Correlation of the distances between answers with those between their sources, with kind, source body
    and target body held fixed.

    1: answers differ as their sources do; 0: they do not depend on which source it was. The first case of a
    group (``order``) has the group's values and the others have none, so that tests count a group once.
    Cases whose kind is not known have none.
    """

    card = MetricCard(
        name="sif",
        summary="whether answers of one kind differ from one another as their sources do",
        version="1",
        tasks=(),
        values=(
            _value(
                "sif",
                "SIF",
                "correlation of distances between answers with distances between their sources",
                unit="1",
                better="higher",
                least=-1.0,
                formula="Pearson correlation over the pairs of clips of a group, 0 where either distance "
                "never varies; " + GROUP.format(least=LEAST, frames=RAW),
            ),
            _value(
                "sif.fixed",
                "SIF, length-matched",
                "SIF of clips brought to one length",
                unit="1",
                better="higher",
                least=-1.0,
                formula="as sif; " + GROUP.format(least=LEAST, frames=FIXED),
            ),
            _value(
                "sif.variation",
                "SIF, variation",
                "how much answers of one kind differ, in shares of what their sources do",
                unit="1",
                better="none",
                least=0.0,
                formula="mean distance between answers over that between sources, in squared heights of "
                "either body, as sif",
            ),
        ),
        kind="pair",
    )
    least = LEAST

    def extract(self, comparison: Comparison) -> np.ndarray:
        """``(frames, source joints + target joints + 2, 3)``: places in heights of either body, then the
        kind as three numbers, then the number of the source's joints. Empty where the kind is not known."""
        case = comparison.case
        if not case.info.kind:
            return np.zeros((0, FACTS, 3))
        source, answer = compared(comparison)
        frames = min(len(source), len(answer))
        kind = [int(part, 16) for part in _chunks(digest(case.info.kind, 12))]
        facts = np.broadcast_to([kind, [source.shape[1], 0, 0]], (frames, FACTS, 3))
        return np.concatenate([source[:frames], answer[:frames], facts], axis=1)

    def values(self, clips: Sequence[np.ndarray]) -> Sequence[Mapping[str, float]]:
        """The values of each clip of a pair: at the first of every group."""
        groups: dict[tuple[float, ...], list[int]] = {}
        for number, clip in enumerate(clips):
            if len(clip):
                groups.setdefault(tuple(clip[0, -FACTS].tolist()), []).append(number)
        values: list[Mapping[str, float]] = [{} for _ in clips]
        for numbers in groups.values():
            if len(numbers) >= LEAST:
                both = [_parts(clips[number]) for number in numbers]
                places = order([source for source, _ in both])
                values[numbers[places[0]]] = group([both[place] for place in places])
        return values


def compared(comparison: Comparison) -> tuple[np.ndarray, np.ndarray]:
    """What is compared of source and answer: ``(frames, joints, 3)`` in heights of either body."""
    source = comparison.case.source
    places = source.positions[:, structure_joints(source.character)]
    answer = comparison.predicted[:, comparison.joints]
    return places / source.character.height, answer / comparison.height


def order(sources: Sequence[np.ndarray]) -> list[int]:
    """Places of the clips of a group: the shortest first, among equals that of the least mean coordinate.
    Distances depend on which of two clips comes first, and the order is to depend on sources alone."""
    return sorted(
        range(len(sources)), key=lambda place: (len(sources[place]), float(sources[place].mean()))
    )


def group(clips: Sequence[tuple[np.ndarray, np.ndarray]]) -> dict[str, float]:
    """The values of a group: sources and answers ``(frames, joints, 3)`` of its clips."""
    sources, answers = zip(*clips, strict=True)
    raw = [distances(part) for part in (sources, answers)]
    fixed = [distances([to_length(clip, LENGTH) for clip in part]) for part in (sources, answers)]
    of_sources = float(raw[0].mean())
    return {
        "sif": float(correlation(*raw)),
        "sif.fixed": float(correlation(*fixed)),
        **({"sif.variation": float(raw[1].mean()) / of_sources} if of_sources > 0.0 else {}),
    }


def distances(clips: Sequence[np.ndarray]) -> np.ndarray:
    """``(pairs,)``: the distance of every two clips ``(frames, joints, 3)``, the first with all others,
    then the second with those after it."""
    return np.array(
        [distance(a, b) for number, a in enumerate(clips) for b in clips[number + 1 :]], dtype=np.float64
    )


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """The mean squared coordinate of what is left of a clip b when the frames of a are put onto its own by
    a rotation and a scale each (Umeyama 1991), over the first frames that both have."""
    frames = min(len(a), len(b))
    a, b = (each[:frames].astype(np.float64) for each in (a, b))
    a, b = (each - each.mean(axis=1, keepdims=True) for each in (a, b))
    left, sizes, right = np.linalg.svd(np.einsum("fjc,fjd->fcd", a, b))
    sizes[:, -1] *= np.sign(np.linalg.det(left @ right))
    size = np.einsum("fjc,fjc->f", a, a)
    fitted = np.divide(sizes.sum(axis=1) ** 2, size, out=np.zeros(frames), where=size > 0.0)
    rest = np.einsum("fjc,fjc->f", b, b) - fitted
    return float(np.maximum(rest, 0.0).mean()) / (3 * a.shape[1])


def correlation(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Pearson's, of ``(pairs,)`` with every row of ``(..., pairs)``; 0 where either never varies."""
    a, b = (each - each.mean(axis=-1, keepdims=True) for each in (a, b))
    varies = np.minimum(a.std(), b.std(axis=-1)) >= CONSTANT
    sizes = np.sqrt((a @ a) * (b * b).sum(axis=-1))
    return np.clip(np.divide(b @ a, sizes, out=np.zeros(b.shape[:-1]), where=varies), -1.0, 1.0)


def to_length(clip: np.ndarray, frames: int) -> np.ndarray:
    """A clip brought to so many frames, from its first to its last, by lines between them."""
    at = np.linspace(0.0, len(clip) - 1.0, frames)
    before = np.clip(at.astype(int), 0, max(len(clip) - 2, 0))
    share = (at - before)[:, None, None]
    after = np.minimum(before + 1, len(clip) - 1)
    return clip[before] * (1.0 - share) + clip[after] * share


# ------------------------------------------------------------------------------------- of several groups
@dataclass(frozen=True)
class Summary:
    """Of groups: the mean SIF, its 95 % interval, and the p-value of the shuffle test."""

    mean: float
    low: float
    high: float
    p: float


def summary(groups: Sequence[tuple[np.ndarray, np.ndarray]], blocks: Sequence[Hashable]) -> Summary:
    """The mean SIF of groups, from the ``(pairs,)`` distances of sources and of answers of each.

    blocks: of each group, what it shares with others that are not independent of it: its source body.
    Interval: of the mean over blocks drawn with replacement. p, one-sided: how often the mean is as high
    when the answers of every group are exchanged at random, groups of a block by the same draw. The draws
    are those of the toolkit (``sif/stats.py``), so that its numbers are met. Raises ValueError where there
    is no group.
    """
    if not groups:
        raise ValueError("there is no group")
    values = np.array([correlation(*each) for each in groups])
    number = {block: place for place, block in enumerate(dict.fromkeys(blocks))}
    places = np.array([number[block] for block in blocks])
    sums, counts = np.bincount(places, values), np.bincount(places)
    drawn = np.random.RandomState(SEED).randint(0, len(number), (DRAWS, len(number)))
    means = np.sort(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1))
    beyond = round(0.025 * DRAWS)
    shares = np.random.RandomState(SEED).rand(DRAWS, len(number))
    shuffled = [exchanged(*each, shares[:, place]) for each, place in zip(groups, places, strict=True)]
    hits = int((np.mean(shuffled, axis=0) >= values.mean() - 1e-12).sum())
    return Summary(
        float(values.mean()), float(means[beyond]), float(means[-1 - beyond]), (1 + hits) / (1 + DRAWS)
    )


def exchanged(sources: np.ndarray, answers: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """SIF of a group whose answers are exchanged: ``(draws,)``.

    sources, answers: ``(pairs,)`` distances. shares: ``(draws,)`` from 0 to 1, of the way through all
    orders of the clips, sorted as words are.
    """
    clips = round((1.0 + np.sqrt(1.0 + 8.0 * len(sources))) / 2.0)
    pairs = np.triu_indices(clips, 1)
    between = np.zeros((clips, clips))
    between[pairs] = answers
    between += between.T
    left, orders = np.tile(np.arange(clips), (len(shares), 1)), np.empty((len(shares), clips), dtype=int)
    for place in range(clips):
        shares = shares * (clips - place)
        chosen = np.minimum(shares.astype(int), clips - place - 1)
        shares = shares - chosen
        there = np.arange(clips - place) == chosen[:, None]
        orders[:, place] = left[there]
        left = left[~there].reshape(len(left), -1)
    return correlation(sources, between[orders[:, pairs[0]], orders[:, pairs[1]]])


def _parts(clip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Source and answer of an extract."""
    joints = int(clip[0, -1, 0])
    return clip[:, :joints], clip[:, joints:-FACTS]


def _chunks(digits: str) -> tuple[str, str, str]:
    """Hex digits in three parts, each a number that single precision holds."""
    return digits[:4], digits[4:8], digits[8:]


plugin = Sif
