"""Methods: a source motion becomes a motion of a target character."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

from retarget_bench.api.cases import TASKS
from retarget_bench.api.completing import texts, words
from retarget_bench.api.datasets import Cast, Manifest
from retarget_bench.motion.character import Character
from retarget_bench.motion.ground import Ground
from retarget_bench.motion.motion import Motion, Prediction

Parameters = Mapping[str, str | int | float | bool]


@dataclass(frozen=True)
class Asset:
    """A file or folder outside a method's code that its answers depend on: weights, a body model.

    what: it in a few words, "the weights of the authors". sha256: of a file that must be just this one.
    """

    what: str
    sha256: str = ""


@dataclass(frozen=True)
class MethodCard:
    """Description of a method, and its needs.

    title:      the name as people write it, a constant (``HuMoT``); "": the plug-in's, with spaces.
    authors_weights: where the weights of the paper's authors, which ``weights`` also takes, can be had.
    published:  of a method with a paper: sets of parameters with which it is as published.
    differs:    of a method with a paper: parameter -> how its default differs from the paper, in a few
                words; of a method without one, what distinguishes it from others of its kind.
    accepts:    the kinds of source it can read: ``motion`` (rotations), ``positions``, ``points`` (on the
                surface of an unknown body) and/or ``surface``.
    needs:      privileged inputs, out of ``reference``, ``second_reference``, ``target_motions``,
                ``other_clips``, ``source_motion``. Rows of such a method are marked privileged and
                never ranked.
    control:    a row that bounds the scale (rest pose, reference): shown, never ranked.
    stochastic: the result depends on ``context.seed``.
    default:    takes part in a plain ``bench run`` (untrained, or weights are shipped).
    apart:      of a method that does not take part: why not, in a few words ("training not finished").
    variants:   sets of parameters with which it takes part a further time.
    uses:       inputs that are not privileged: ``training``, what the data set has to train on.
    tasks:      those whose plain runs it takes part in, if it is a default at all.
    environment: the Python that answers, or the command that starts it; "": this one.
    assets:     files that answers depend on, by name: a parameter's, whose value is the path, or that of a
                file beside the module. They belong to the key of a result (``plugins/assets.py``).
    trained_on: what has been trained on, out of ``characters``, ``structures``, ``kinds``, ``clips``; None:
                nothing. The manifest of weights has precedence.
    """

    name: str
    summary: str
    version: str
    title: str = ""
    paper: str = ""
    published: tuple[Parameters, ...] = ()
    differs: Mapping[str, str] = field(default_factory=dict)
    licence: str = ""
    authors_weights: str = ""
    accepts: tuple[str, ...] = ("motion",)
    needs: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    tasks: tuple[str, ...] = TASKS
    control: bool = False
    stochastic: bool = False
    default: bool = True
    apart: str = ""
    variants: tuple[Parameters, ...] = ()
    environment: str = ""
    assets: Mapping[str, Asset] = field(default_factory=dict)
    trained_on: Mapping[str, Sequence[str]] | None = None
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Parameter name -> one line that says what it does and which values it takes."""

    def __post_init__(self) -> None:
        texts(self, "name", "summary", "version", "title", "paper", "licence", "authors_weights")
        words(self, "accepts", "needs", "uses", "tasks")


@dataclass(frozen=True)
class TrainingShare:
    """What training of weights has seen of the windows of its paper's, counted by their frames.

    part: of all; 1 is as much. at_least: some windows were not counted.
    """

    part: float
    at_least: bool = False

    def __str__(self) -> str:
        per_cent = 100 * self.part
        return f"{'at least ' * self.at_least}{per_cent:.{'2g' if per_cent < 99.5 else '0f'}} %"


@dataclass(frozen=True)
class Context:
    """The inputs of a method beside the source motion and the target character.

    ground: the case's floor, for post-processors; None for methods, and where it is not known.
    The privileged inputs are None unless the card's ``needs`` names them.
    second_reference: another answer that is as right as the reference (``Case.alternative``).
    other_clips: motions of the target in other clips of the split (of the others where it has none), in a
    fixed order, loaded when indexed.
    target_motions: every reference motion of the target, this clip's included.
    source_motion: the motion that the source's points are of; a source by rotations itself.
    reconstruction: the method's answer to the source on its own body, for post-processors that need it.
    training: for cards that use it: ``Dataset.training()``, always the same object; None without.
    """

    seed: int = 0
    device: str = "cpu"
    precision: Literal["float32", "float64"] = "float32"
    ground: Ground | None = None
    reference: Prediction | None = None
    second_reference: Prediction | None = None
    target_motions: Sequence[Prediction] | None = None
    other_clips: Sequence[Prediction] | None = None
    source_motion: Motion | None = None
    reconstruction: Prediction | None = None
    training: Cast | None = None


class Method(ABC):
    """Turns a source motion into a motion of a target character.

    A source is a ``Source`` of a kind that the card accepts; methods annotate the kinds that they accept.
    What is not abstract is optional, and stands here with its default.
    """

    card: MethodCard

    @abstractmethod
    def supports(self, source: Character, target: Character) -> str | None:
        """None, or the reason why this pair cannot be retargeted, as a sentence."""

    @abstractmethod
    def retarget(self, source: Any, target: Character, *, context: Context) -> Prediction:
        """The motion of ``target``: same frames, same rate, built with ``target.motion(...)``,
        ``target.positions(...)`` or ``target.surface(...)``."""

    # -------------------------------------------------------------------------------------- answers
    retarget_batch: Callable[..., Sequence[Prediction]] | None = None
    """``retarget_batch(sources, targets, *, contexts)`` of a method that answers many cases faster together
    than one by one: for speed alone. Answer k is what ``retarget(sources[k], targets[k],
    context=contexts[k])`` gives, to 1e-5 of the height, whatever else is in the batch, in any order;
    lengths, rates and bodies may differ (those of the engine's batches are alike, see ``batches.py``). What
    ``supports`` refuses is never asked. Where this raises, or an answer is not valid, every case is asked
    on its own."""

    def reconstruct_batch(
        self, sources: Sequence[Any], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> Sequence[Prediction]:
        """The answer to each source on the source's own body, where it is asked for a target.

        Most ask nothing of the target; a method with networks for each kind of body takes the target's.
        """
        del targets
        own = [source.character for source in sources]
        if self.retarget_batch is not None:
            return self.retarget_batch(sources, own, contexts=contexts)
        questions = zip(sources, own, contexts, strict=True)
        return [self.retarget(source, body, context=context) for source, body, context in questions]

    def warm_up(self) -> None:  # noqa: B027
        """Load what all answers need, such as weights.

        Called once, before the first question, in the process that those that answer are forked from: what
        is loaded later is loaded anew for every batch."""

    attention: Callable[[Motion], Mapping[str, Any]] | None = None
    """``attention(source)`` gives the fields of ``evaluation.attention.Attention``, for ``bench plot``."""

    # --------------------------------------------------------------------------- of what it is made
    @cached_property
    def root_rule(self) -> str:
        """What scales the root's path; "": unknown."""
        return ""

    @cached_property
    def stages(self) -> Mapping[str, Method]:
        """The methods that it is composed of, each under the parameter that names its weights or is a path
        to them. Their code belongs to the keys of its results; its own ``weights_hash`` has their weights
        in it."""
        return {}

    @cached_property
    def weights_hash(self) -> str:
        """Identifies the weights in keys of results; "" for none. Raises BenchError where they are
        missing."""
        return ""

    @cached_property
    def weights_label(self) -> str:
        """The name in results of weights that are given by a path. Raises BenchError likewise."""
        return ""

    @cached_property
    def training_manifest(self) -> Manifest | None:
        """The training data of the weights; None where it is untrained or does not say."""
        return self.card.trained_on

    @cached_property
    def training_share(self) -> TrainingShare | None:
        """How much of its paper's training the weights have had; None: not known, or no paper says."""
        return None

    # -------------------------------------------------------------------------------- to be trained
    from_pairs: bool = False
    """Whether its training clips come from ``training_pairs()``: those of one name, by different
    characters, are the same performance frame by frame."""

    @cached_property
    def ablations(self) -> Mapping[str, Ablation]:
        """Short name -> a table of its paper; ``bench ablate METHOD NAME`` trains every row and prints ours
        below the published numbers."""
        return {}


@dataclass(frozen=True)
class Ablation:
    """A table of a paper in which a method is trained again with one thing changed.

    tables: names of the published tables that print its rows (``bench table --paper NAME``).
    rows: label, as printed where the paper has the row -> parameters of the method that it trains.
    notes: sentences on the printed numbers, and on how ours differ.
    """

    title: str
    tables: tuple[str, ...]
    rows: Mapping[str, Parameters]
    notes: tuple[str, ...] = ()
