"""The contracts between the engine and its plug-ins. Read this first.

Every contract is structural: a plug-in needs no base class and may import nothing from here. It is
enough that its objects have the attributes and methods named below. A plug-in is a callable, mostly a
class, that takes its parameters as keywords and returns such an object; in a file it is the module's
attribute ``plugin``.

The one path: a Dataset gives Cases; a Method turns a case's source motion into a motion of the target;
a Metric compares that prediction with the case and returns named numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.ground import FLAT
from retarget_bench.motion.ground import Ground as Ground
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.motion import Prediction as Prediction

if TYPE_CHECKING:
    from retarget_bench.evaluation.comparison import Comparison

SPLITS = ("self", "intra", "cross")
"""self: same character; intra: same structure, another character; cross: another structure."""

TASKS = ("retarget", "reconstruct", "denoise", "upsample")
"""All but the first are derived from any data set's own motion (``retarget_bench/evaluation/tasks``)."""

Direction = Literal["lower", "higher", "target", "none"]
Parameters = Mapping[str, str | int | float | bool]


# --------------------------------------------------------------------------------------------- cases
@dataclass(frozen=True, eq=False)
class Contacts:
    """Which contact joints are planted in which frame.

    roles: the roles of the contact joints (``left_foot``, ``left_toe``, ...).
    planted: ``(frames, len(roles))`` bool: rests, and has rested since the frame before.
    pivoting: likewise bool, where it is known: turns about a point of the foot that rests on the ground.
            What is neither planted nor pivoting is free.
    """

    roles: tuple[str, ...]
    planted: np.ndarray
    pivoting: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Touch:
    """A place of a body that one of its own joints should rest on for a while.

    end:     the role of the joint that goes there (``left_hand``).
    point:   ``(3,)`` metres, in that joint's frame: what of it rests on the place (the palm).
    bearing: the role of the joint that carries the place (``right_up_leg``).
    place:   ``(3,)`` metres, in that joint's frame.
    rests:   ``(frames,)`` bool: the point should be on the place, in full, not on its way.

    A joint's frame is at the joint, turned by its orientation relative to the common reference pose
    (``relative`` in ``motion/alignment.py``): along the world's axes while the body is in that pose.
    """

    end: str
    point: np.ndarray
    bearing: str
    place: np.ndarray
    rests: np.ndarray


@dataclass(frozen=True)
class CaseInfo:
    """What is known of a case without loading it. Only this travels between processes.

    id:     ``dataset/source>target/clip``, stable for ever.
    clip:   the source clip: the cluster of the statistics.
    kind:   kind of performance (``walk``), or "" where the data set does not know.
    frames: length, or 0 where it is known only after loading.
    """

    id: str
    task: str
    split: str
    source: str
    target: str
    clip: str
    kind: str = ""
    frames: int = 0

    @property
    def pair(self) -> str:
        return f"{self.source}>{self.target}"


@dataclass(frozen=True, eq=False)
class Case:
    """One question put to a method, and what is known of the right answer.

    source:     the motion to be retargeted (its ``character`` is the source body).
    target:     the body that shall perform it.
    reference:  the right answer, or None (then only reference-free metrics apply).
    contacts:   true contact labels of the *target*, or None (then they are found by speed).
    alternative: a second answer that is as right as the reference, where one is known.
    conditions: of tasks such as denoising: noise level, share of joints.
    touches:    where the *target* should touch itself, or None where that is not known. Empty: nowhere.
    """

    info: CaseInfo
    source: Prediction
    target: Character
    reference: Prediction | None = None
    contacts: Contacts | None = None
    ground: Ground = FLAT
    conditions: Mapping[str, float] = field(default_factory=dict)
    alternative: Prediction | None = None
    touches: tuple[Touch, ...] | None = None


# ------------------------------------------------------------------------------------------ data sets
@dataclass(frozen=True)
class DatasetCard:
    """What a data set is, under which terms, and how to get it."""

    name: str
    summary: str
    version: str
    licence: str
    obtain: str
    tasks: tuple[str, ...] = ("retarget",)
    splits: tuple[str, ...] = SPLITS
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Parameter name -> one line that says what it does."""


class Dataset(Protocol):
    """A source of cases. Building one must be quick: files are read when cases are asked for.

    ``content``: what identifies the data in keys (a hash of the files, or generator version and
    parameters). ``label``: what tables call it (``mixamo``, or ``mixamo san-partial (23 of 106 clips)``).
    ``notes``: sentences that belong under every table of it (what was dropped and why).
    """

    card: DatasetCard

    @property
    def content(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def notes(self) -> Sequence[str]: ...
    def characters(self) -> Mapping[str, Character]: ...
    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """A fixed list, in a fixed order."""

    def load(self, info: CaseInfo) -> Case: ...


class RealDataset(Dataset, Protocol):
    """A data set that has cases without references, and real motion to hold answers to them against."""

    def real(self, task: str, structure: str) -> Sequence[CaseInfo]:
        """Cases, for ``load``, whose references are the tested part's real motion of bodies of a structure:
        each body and clip once, with the kinds of the cases without references."""


class TrainingClips(Protocol):
    """What one character performs for training: motions, each made when it is asked for."""

    @property
    def names(self) -> Sequence[str]: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Motion: ...


class TrainingDataset(Dataset, Protocol):
    """A data set that can be trained on. Optional: without these methods it is for tests alone."""

    def training(self) -> Mapping[str, Mapping[str, TrainingClips]]:
        """Structure -> character -> its clips, whichever part the cases are of; none of them is in a case
        of the test or of ``validation()``. Empty where there is nothing to train on."""

    def validation(self) -> Dataset:
        """What training is steered by: cases that share no clip with the test and none with
        ``training()``, best with characters that ``training()`` does not have."""

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        """``characters``, ``structures``, and ``kinds`` or ``clips``: all that training and its validation
        have. Weights carry it, so that tables can part what is new to them from what is not."""


# -------------------------------------------------------------------------------------------- methods
@dataclass(frozen=True)
class MethodCard:
    """What a method is, and what it asks for.

    accepts:    the kinds of source it can read: ``motion`` (rotations) and/or ``positions``.
    needs:      privileged inputs, out of ``reference``, ``second_reference``, ``target_motions``,
                ``other_clips``. Rows of such a method are marked privileged and never ranked.
    control:    a row that bounds the scale (rest pose, reference): shown, never ranked.
    stochastic: the result depends on ``context.seed``.
    default:    takes part in a plain ``bench run`` (untrained, or weights are shipped).
    variants:   sets of parameters with which it takes part a further time.
    uses:       inputs that are not privileged: ``training``, what the data set has to train on.
    tasks:      those whose plain runs it takes part in, if it is a default at all.
    """

    name: str
    summary: str
    version: str
    paper: str = ""
    licence: str = ""
    accepts: tuple[str, ...] = ("motion",)
    needs: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    tasks: tuple[str, ...] = TASKS
    control: bool = False
    stochastic: bool = False
    default: bool = True
    variants: tuple[Parameters, ...] = ()
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Parameter name -> one line that says what it does and which values it takes."""
    reported: Mapping[str, float] = field(default_factory=dict)
    """Published numbers, ``"table/row/column" -> value``, for people to compare with."""


@dataclass(frozen=True)
class Context:
    """All that a method may know beside the source motion and the target character.

    ground: the case's floor, for post-processes (``post.py``); None for methods, and where it is not known.
    The privileged inputs are None unless the card's ``needs`` names them.
    second_reference: another answer that is as right as the reference (``Case.alternative``).
    other_clips: motions of the target in other clips of the split (of the others where it has none), in a
    fixed order, loaded when indexed.
    target_motions: every reference motion of the target, this clip's included.
    training: for cards that use it: ``TrainingDataset.training()``, always the same object; None without.
    """

    seed: int = 0
    device: str = "cpu"
    precision: Literal["float32", "float64"] = "float32"
    ground: Ground | None = None
    reference: Prediction | None = None
    second_reference: Prediction | None = None
    target_motions: Sequence[Prediction] | None = None
    other_clips: Sequence[Prediction] | None = None
    training: Mapping[str, Mapping[str, TrainingClips]] | None = None


class Method(Protocol):
    """Turns a source motion into a motion of a target character."""

    card: MethodCard

    def supports(self, source: Character, target: Character) -> str | None:
        """None, or the reason why this pair cannot be retargeted, as a sentence."""

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        """The motion of ``target``: same frames, same rate, built with ``target.motion(...)`` or
        ``target.positions(...)``."""


class BatchMethod(Method, Protocol):
    """A method that answers many cases faster together than one by one. Optional: for speed alone."""

    def retarget_batch(
        self, sources: Sequence[Prediction], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> Sequence[Prediction]:
        """Answer k is what ``retarget(sources[k], targets[k], context=contexts[k])`` gives, to 1e-5 of the
        height, whatever else is in the batch, in any order; lengths, rates and bodies may differ (those of
        the engine's batches are alike, see ``batches.py``). What ``supports`` refuses is never asked. Where
        this raises, or an answer is not valid, every case is asked on its own."""


# -------------------------------------------------------------------------------------------- metrics
@dataclass(frozen=True)
class Value:
    """One named number that a metric returns, as its card declares it.

    id:        ``mpjpe_h.world``; unique over all metrics.
    label:     the column's heading.
    meaning:   one line for people who never saw it.
    unit:      ``% of height``, ``m``, ``1``, ...
    better:    ``lower``, ``higher``, ``target`` (best at ``goal``, ranked by |log(value / goal)|) or
               ``none`` (a description, never ranked).
    tolerance: by how much a value may move before a regression gate says so, in the value's unit.
    needs:     out of ``reference``, ``source``, ``contacts``, ``rotations``, ``ground``; where one is
               missing the value is *not applicable*.
    index:     what the value is a curve over (``threshold``, ``joint``), or "" for one number.
    with_self: in the intra group this value pools self pairs too (a legacy protocol).
    protocol: of position errors, what fixes the number: the keys of ``protocols.PROTOCOL``. Two protocols
               differ by what these say; ``bench explain`` lists them.
    """

    id: str
    label: str
    meaning: str
    unit: str
    better: Direction
    formula: str
    source: str
    tolerance: float = 1e-6
    goal: float = 1.0
    needs: tuple[str, ...] = ("reference",)
    index: str = ""
    with_self: bool = False
    protocol: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class MetricCard:
    """A family of values that are computed together; ``version`` moves when any number does.

    tasks: those whose plain runs it takes part in."""

    name: str
    summary: str
    version: str
    values: tuple[Value, ...]
    tasks: tuple[str, ...] = TASKS[:1]


class Metric(Protocol):
    """Turns one comparison into named numbers."""

    card: MetricCard

    def compute(self, comparison: Comparison) -> Mapping[str, float | Mapping[str, float]]:
        """Value id -> number, or index -> number for curves. Ids that do not apply are left out."""


# ---------------------------------------------------------------------------------------- set metrics
@dataclass(frozen=True, eq=False)
class CaseFeatures:
    """What a set metric keeps of one case: its windows as feature vectors.

    generated: ``(windows, d)`` float32, of the prediction.
    real:      ``(windows, d)`` float32, of the same windows of the reference; no rows without one.
    speed:     ``(windows,)`` level speed of the reference's root, else the source's, heights per second.
    """

    generated: np.ndarray
    real: np.ndarray
    speed: np.ndarray


@dataclass(frozen=True, eq=False)
class Sample:
    """A set of windows. features: ``(n, d)`` float64. clips: ``(n,)`` the source clip of each.

    whole, rows: of a part, the set that it is taken from and the indices of its windows there. What a
    metric found out about pairs of windows of the whole it need not find out again for its parts.
    """

    features: np.ndarray
    clips: np.ndarray
    whole: Sample | None = None
    rows: np.ndarray | None = None

    def part(self, rows: np.ndarray) -> Sample:
        """Some windows of a set, by their indices."""
        return Sample(self.features[rows], self.clips[rows], self, rows)


class SetMetric(Protocol):
    """Compares sets of motions, not motion by motion: FID and its kin.

    A set is of one split and one target structure. ``retarget_bench/sets`` draws it and stores numbers."""

    card: MetricCard

    def network(self, target: Character) -> str:
        """The hash of what makes the features of this body's structure: part of the key of results.
        Raises NotSupported with the reason where there is none."""

    def features(self, comparison: Comparison) -> CaseFeatures:
        """The features of a case; no windows where the clip is too short."""

    def least(self, value_id: str) -> int:
        """How many windows each set needs for a value to mean anything."""

    def value(self, value_id: str, real: Sample, generated: Sample) -> float:
        """A value of two sets; not a number where it is undefined."""
