"""Methods: a source motion becomes a motion of a target character."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from retarget_bench.api.cases import TASKS
from retarget_bench.api.datasets import TrainingClips
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
    source_motion: Motion | None = None
    reconstruction: Prediction | None = None
    training: Mapping[str, Mapping[str, TrainingClips]] | None = None


class Method(Protocol):
    """Turns a source motion into a motion of a target character.

    A source is a ``Source`` of a kind that the card accepts; methods annotate the kinds that they accept.
    """

    card: MethodCard

    def supports(self, source: Character, target: Character) -> str | None:
        """None, or the reason why this pair cannot be retargeted, as a sentence."""

    def retarget(self, source: Any, target: Character, *, context: Context) -> Prediction:
        """The motion of ``target``: same frames, same rate, built with ``target.motion(...)``,
        ``target.positions(...)`` or ``target.surface(...)``."""


class BatchMethod(Method, Protocol):
    """A method that answers many cases faster together than one by one. Optional: for speed alone."""

    def retarget_batch(
        self, sources: Sequence[Any], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> Sequence[Prediction]:
        """Answer k is what ``retarget(sources[k], targets[k], context=contexts[k])`` gives, to 1e-5 of the
        height, whatever else is in the batch, in any order; lengths, rates and bodies may differ (those of
        the engine's batches are alike, see ``batches.py``). What ``supports`` refuses is never asked. Where
        this raises, or an answer is not valid, every case is asked on its own."""


@dataclass(frozen=True)
class Ablation:
    """A table of a paper in which a method is trained again with one thing changed.

    A method offers ``ablations``, a mapping from a short name to one; ``bench ablate METHOD NAME`` trains
    every row and prints ours below the published numbers.

    tables: names of the published tables that print its rows (``bench table --paper NAME``).
    rows: label, as printed where the paper has the row -> parameters of the method that it trains.
    notes: sentences on the printed numbers, and on how ours differ.
    """

    title: str
    tables: tuple[str, ...]
    rows: Mapping[str, Parameters]
    notes: tuple[str, ...] = ()
