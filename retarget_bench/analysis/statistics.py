"""Uncertainty of means over source clips: intervals, paired tests, and correction for many tests.

Pairs of one source clip are not independent, so the clip is the unit: numbers of cases become means per
clip first, and everything here takes those. All of it is deterministic: the same numbers give the same
intervals and p-values on every machine.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

LEVEL = 0.95
"""Of intervals."""
ALPHA = 0.05
"""Differences with a smaller adjusted p-value are called differences."""
ENOUGH_CLIPS = 10
"""With fewer clips no interval is given, and no difference called one."""
RARE = 0.04
"""Failures on so small a share of all clips count as rare."""
CLIPS_FOR_RARE = math.ceil(math.log(ALPHA) / math.log(1 - RARE))
"""With fewer clips, more than 5 % of all samples have none of them; what no clip shows no test can see."""
POWER = 0.8
"""Share of data sets in which ``clips_for_power`` clips give a verdict."""
EXACT_CLIPS = 13
"""Up to here all sign flips are tried."""
SAMPLED_FLIPS = 99_999
"""Above, so many are drawn where a p-value of the family is between half the level and twice that."""
FIRST_FLIPS = 9_999
"""So many are drawn first, and do where none is; the smallest p-value is then one in ten thousand."""
FLIPS_AT_ONCE = 500
"""Few enough for the processor's cache."""
FARTHEST_ERRORS = 1e3
"""Standard errors beyond which the end of an interval is not looked for."""
FARTHEST_RATIO = 1e3
"""A ratio counts as missing its goal by this factor where it misses it by more, or is not positive."""


@dataclass(frozen=True)
class Interval:
    """From ``low`` to ``high``, in the unit of the mean it belongs to."""

    low: float
    high: float


def per_clip(numbers: np.ndarray, clips: np.ndarray) -> np.ndarray:
    """Mean per clip of numbers ``(..., cases)``: ``(..., clips)``; nan where a clip has no number.

    clips: ``(cases,)`` from 0, the clip of every case, in increasing order.
    """
    starts = np.flatnonzero(np.diff(clips, prepend=-1))
    there = ~np.isnan(numbers)
    sums = np.add.reduceat(np.where(there, numbers, 0.0), starts, axis=-1)
    counts = np.add.reduceat(there.astype(float), starts, axis=-1)
    with np.errstate(invalid="ignore"):
        return sums / counts


def mean_intervals(means: np.ndarray) -> list[Interval | None]:
    """95 % interval of the mean over clips of each row of ``(rows, clips)``; nan: the row lacks the clip.

    Studentised and corrected for skew by Hall's cubic transformation (Hall 1992, "On the removal of
    skewness by transformation"), since errors per clip have long tails. With g the skewness, n the clips,
    s the standard error and a = g / sqrt(n), quantiles q of Student's t become
    Q = 3/a ((1 + a (q - a/6))^(1/3) - 1), and the interval is mean - Q s. None for rows of fewer than
    ``ENOUGH_CLIPS`` clips.
    """
    n, centre, error, quantile = _student(means)
    offsets = np.where(np.isnan(means), 0.0, means - centre[:, None])
    spread = np.sqrt((offsets**2).sum(axis=1) / np.maximum(n, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        skewness = (offsets**3).sum(axis=1) / np.maximum(n, 1) / spread**3
    a = np.nan_to_num(skewness) / np.sqrt(np.maximum(n, 1))
    low, high = centre - _hall(quantile, a) * error, centre - _hall(-quantile, a) * error
    return [
        Interval(*ends) if k >= ENOUGH_CLIPS else None
        for k, *ends in zip(n, low.tolist(), high.tolist(), strict=True)
    ]


def _student(means: np.ndarray) -> tuple[np.ndarray, ...]:
    """Per row of ``(rows, clips)``: clips, mean, standard error, and the quantile of Student's t."""
    from scipy.special import stdtrit  # type: ignore[import-untyped]

    there = ~np.isnan(means)
    n = there.sum(axis=1)
    centre = np.where(there, means, 0.0).sum(axis=1) / np.maximum(n, 1)
    squares = np.where(there, (means - centre[:, None]) ** 2, 0.0).sum(axis=1)
    freedom = np.maximum(n - 1, 1)
    error = np.sqrt(squares / freedom / np.maximum(n, 1))
    return n, centre, error, stdtrit(freedom, (1 + LEVEL) / 2)


def _hall(q: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Hall's inverse transformation of quantiles; without skew they stay as they are."""
    flat = np.abs(a) < 1e-6
    b = np.where(flat, 1.0, a)
    return np.where(flat, q, 3 / b * (np.cbrt(1 + b * (q - b / 6)) - 1))


# ----------------------------------------------------------------------------------------------- pairs
def sign_flip(differences: np.ndarray) -> np.ndarray:
    """Two-sided p-values ``(rows,)`` of the mean of paired differences ``(rows, clips)`` being 0.

    The share of sign flips of the clips whose statistic is at least as far from 0 as the one observed: of
    all 2^clips up to ``EXACT_CLIPS``, above of ``SAMPLED_FLIPS`` drawn ones and the observed one. The
    statistic is the mean, studentised and corrected for skew as in ``mean_intervals``. Where differences
    are as likely to be positive as negative, the test is exact whatever the statistic; where their
    distribution leans to one side, flips of a plain mean would raise several times too many alarms.
    nan: the row lacks the clip. What no clip shows no test can see: ``unseen``.
    """
    p = np.ones(len(differences))
    open_ = np.arange(len(p))
    for draws in _draws(differences.shape[1]):
        p[open_] = _shares(differences[open_], draws)
        open_ = open_[_close(p[open_])]
    return p


def step_down(differences: np.ndarray) -> np.ndarray:
    """``sign_flip`` adjusted for all rows, by the greatest statistic: Westfall and Young's (1993) max-T.

    The clips are flipped in all rows at once, so that rows that say much the same cost little more than
    one. A row's p-value is the share of flips whose greatest statistic, over the rows whose own is not
    farther from 0, is at least as far from 0 as the row's; and no less than that of a row farther off.
    """
    order = np.argsort(-_statistic(differences), kind="stable")
    stages = np.empty(len(order), dtype=int)
    stages[order] = np.arange(len(order))
    p = np.ones(len(order))
    for draws in _draws(differences.shape[1]):
        p = _shares(differences, draws, stages)
        p[order] = np.maximum.accumulate(p[order])
        if not _close(p).any():
            break
    return p


def against_best(means: np.ndarray, tolerance: float = 0.0) -> tuple[int, np.ndarray]:
    """The best row of ``(methods, clips)`` (less is better), and the p-values of the other rows.

    Returns its index, and p-values ``(methods,)`` of the differences from the best, 1 for the best itself,
    adjusted as in ``step_down``. The family is all pairs of the methods that are not told from the best
    before (those whose statistic is farther from 0), not only their pairs with the best: which one is best
    was read off the same numbers. p is 1 where means differ by no more than ``tolerance``.
    """
    best = int(np.argmin(means.mean(axis=1)))
    order = np.argsort(-_statistic(differences(means, means[best], tolerance)), kind="stable")
    order = order[order != best]
    stages = np.full(len(means), len(means))
    stages[order] = np.arange(len(order))
    first, second = np.triu_indices(len(means), 1)
    pairs, p = differences(means[first], means[second], tolerance), np.ones(len(means))
    with_best = np.flatnonzero((first == best) | (second == best))
    others = np.where(first == best, second, first)[with_best]
    for draws in _draws(means.shape[1]):
        p[others] = _shares(pairs, draws, np.minimum(stages[first], stages[second]))[with_best]
        p[order] = np.maximum.accumulate(p[order])
        if not _close(p[order]).any():
            break
    averages = means.mean(axis=1)
    p[averages - averages[best] <= tolerance] = 1.0
    return best, p


def paired_intervals(differences: np.ndarray) -> list[Interval | None]:
    """95 % interval of the mean difference, by row of ``(rows, clips)``; None below ``ENOUGH_CLIPS`` clips.

    From the least to the largest shift that ``sign_flip`` does not reject at 5 %, so that the interval and
    the p-value never contradict each other.
    """
    enough = differences.shape[1] >= ENOUGH_CLIPS
    return [_Flips(row).interval() if enough else None for row in differences]


class _Flips:
    """The statistic of paired differences ``(clips,)``, shifted by any amount, under sign flips.

    Sums of powers of shifted differences are polynomials of the shift, so the flips are summed once.
    """

    def __init__(self, differences: np.ndarray) -> None:
        clips = len(differences)
        signs, powers = _signs(clips, _draws(clips)[-1]), differences[:, None] ** np.arange(4)
        self.sums = (signs @ powers / max(1, clips)).T  # of s, s d, s d^2, s d^3 over clips
        self.means = powers.mean(axis=0) if clips else np.zeros(4)
        self.clips = clips

    def p(self, shift: float) -> float:
        """Of the mean being ``shift``."""
        ones, first, second, third = self.sums
        square = np.maximum(0.0, self.means[2] - 2 * shift * self.means[1] + shift**2)
        mean = first - shift * ones
        cube = third - 3 * shift * second + 3 * shift**2 * first - shift**3 * ones
        size = _size(mean, np.asarray(square), cube, self.clips)
        return float((size >= size[0] * (1 - 1e-9)).mean())

    def interval(self) -> Interval:
        centre = float(self.means[1])
        error = math.sqrt(max(0.0, self.means[2] - centre**2) / max(1, self.clips - 1))
        return Interval(self._end(centre, -error), self._end(centre, error))

    def _end(self, centre: float, step: float) -> float:
        """The farthest shift from the centre, in the direction of the step, that is not rejected."""
        if step == 0:
            return centre
        inside, outside = 0.0, 4.0
        while self.p(centre + outside * step) >= ALPHA and outside < FARTHEST_ERRORS:
            inside, outside = outside, 2 * outside
        while outside - inside > 1e-3:
            middle = (inside + outside) / 2
            if self.p(centre + middle * step) >= ALPHA:
                inside = middle
            else:
                outside = middle
        return centre + inside * step


def _draws(clips: int) -> tuple[int, ...]:
    """How many flips are drawn, and then, where a p-value is close to the level; 0: all are tried."""
    return (FIRST_FLIPS, SAMPLED_FLIPS) if clips > EXACT_CLIPS else (0,)


def _close(p: np.ndarray) -> np.ndarray:
    """Whether more flips could put p-values on the other side of the level."""
    close: np.ndarray = (p > ALPHA / 2) & (p < 2 * ALPHA)
    return close


def _shares(differences: np.ndarray, draws: int, stages: np.ndarray | None = None) -> np.ndarray:
    """The share of flips ``(rows,)`` that are at least as far from 0 as what was observed.

    stages: ``(rows,)``; the statistic of a flip is the greatest of all rows of the row's stage or a later
    one. None: every row by itself.
    """
    if not differences.size:
        return np.ones(len(differences))
    signs = _signs(differences.shape[1], draws)
    counts, observed = np.zeros(len(differences)), None
    for start in range(0, len(signs), FLIPS_AT_ONCE):
        sizes = _flipped(signs[start : start + FLIPS_AT_ONCE], differences)
        if observed is None:  # among the others: alone it is rounded otherwise, much so where clips agree
            observed = sizes[0]
        if stages is not None:
            sizes = _greatest(sizes, stages)
        # flips that give the observed statistic up to rounding count as giving it
        counts += (sizes >= observed * (1 - 1e-9)).sum(axis=0)
    return counts / len(signs)


def _greatest(sizes: np.ndarray, stages: np.ndarray) -> np.ndarray:
    """``(flips, rows)``: the greatest of all rows of a row's stage or a later one."""
    late_first = np.argsort(-stages, kind="stable")
    greatest = np.maximum.accumulate(sizes[:, late_first], axis=1)
    return np.asarray(greatest[:, np.searchsorted(-stages[late_first], -stages, side="right") - 1])


def _statistic(differences: np.ndarray) -> np.ndarray:
    """How far the mean differences ``(rows,)`` are from 0."""
    return _flipped(np.ones((1, differences.shape[1])), differences)[0]


def _flipped(signs: np.ndarray, differences: np.ndarray) -> np.ndarray:
    """The statistic ``(flips, rows)`` of differences ``(rows, clips)`` under flips ``(flips, clips)``."""
    there = ~np.isnan(differences)
    values, clips = np.where(there, differences, 0.0), np.maximum(there.sum(axis=1), 1)
    sums = signs @ np.concatenate([values, values**3]).T
    mean, cube = sums[:, : len(values)] / clips, sums[:, len(values) :] / clips
    return _size(mean, (values**2).sum(axis=1) / clips, cube, clips)


def _size(mean: np.ndarray, square: np.ndarray, cube: np.ndarray, clips: np.ndarray | int) -> np.ndarray:
    """The statistic, without its sign.

    mean, cube: ``(flips, ...)`` means of first and third powers; square: ``(...)`` of second ones, which no
    flip changes. The statistic is Hall's: with t = mean / deviation and skewness g,
    t + g t^2/3 + g^2 t^3/27 + g / (6 clips).
    """
    square = np.where(square > 0, square, 1.0)  # no difference at all: every flip is as far from 0
    variance = np.maximum(square - mean**2, 1e-9 * square)
    deviation = np.sqrt(variance)
    skewness = (cube + mean * (2 * mean**2 - 3 * square)) / (variance * deviation)
    t = mean / deviation
    lean = skewness * t / 3
    size: np.ndarray = np.abs(t * (1 + lean + lean**2 / 3) + skewness / (6 * clips))
    return size


@lru_cache(maxsize=4)
def _signs(clips: int, draws: int) -> np.ndarray:
    """``(flips, clips)`` of ±1 in bytes, no flip first: one of every flip and its opposite, or so
    many drawn."""
    if not draws:
        numbers = np.arange(2 ** max(0, clips - 1))[:, None]
        return (1 - 2 * (numbers >> np.arange(clips) & 1)).astype(np.int8)
    words = -(-draws * clips // 64)
    raw = np.random.Philox(key=0).random_raw(words).astype("<u8")  # raw: the same in every numpy
    bits = np.unpackbits(raw.view(np.uint8))[: draws * clips].reshape(draws, clips).astype(np.int8)
    return np.concatenate([np.ones((1, clips), np.int8), 1 - 2 * bits])


# ------------------------------------------------------------------------------- what clips can show
def unseen(clips: int) -> float:
    """The largest share of failing clips that a sample of so many misses in 5 % of all samples.

    1 - 0.05^(1/clips), about 3/clips. A method that does well in a sample may fail on so many clips.
    """
    return 1 - ALPHA ** (1 / max(1, clips))


def clips_for_power(p: float, adjusted: float, clips: int) -> int | None:
    """About how many clips would show a difference in ``POWER`` of all samples.

    Taken as the true one is a difference that gave the p-value p, and so much of it adjusted, on so many
    clips; the test statistic grows with the root of their number, and is normal. None where p is 1.
    """
    from scipy.special import ndtri

    observed, level, power = ndtri([1 - p / 2, 1 - ALPHA * p / adjusted / 2, POWER])
    return math.ceil(clips * ((level + power) / observed) ** 2) if observed > 0 else None


# --------------------------------------------------------------------------------------------- numbers
def differences(first: np.ndarray, second: np.ndarray, tolerance: float) -> np.ndarray:
    """``first - second`` by clip, along the last axis; 0 throughout where no clip differs by more than the
    tolerance of the value."""
    apart = first - second
    return np.where((np.abs(apart) > tolerance).any(axis=-1, keepdims=True), apart, 0.0 * apart)


def losses(numbers: np.ndarray, better: str, goal: float = 1.0) -> np.ndarray:
    """Numbers of a value on a scale where less is better: as they are, negated, or |log(number / goal)|.

    better, goal: as the value's header declares them.
    """
    if better == "higher":
        return -numbers
    if better != "target":
        return numbers
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.abs(np.log(numbers / goal))
    farthest = np.log(FARTHEST_RATIO)
    away = np.where(numbers / goal <= 0, farthest, np.minimum(away, farthest))
    return np.where(np.isnan(numbers), np.nan, away)
