"""Post-processors, which change the answers of any method, and methods composed with them.

``pan+footfix`` is the method ``pan`` whose every answer goes through the post-processor ``footfix``;
``a+b+c`` goes through ``b``, then ``c``. A post-processor is a plug-in like any other: a callable that
takes its parameters as keywords and returns an object of the shape of ``Post``. It is asked once per
answer, sees what the method could see without privileges, and the floor; never the reference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Protocol

from retarget_bench.api import (
    BatchMethod,
    Case,
    CaseInfo,
    Context,
    Method,
    MethodCard,
    Prediction,
    Source,
    optional,
)
from retarget_bench.api.optional import takes_batches
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import kind_of
from retarget_bench.plugins.prediction_check import Invalid, verified


@dataclass(frozen=True)
class PostCard:
    """Description of a post-processor, and the answers that it works on.

    accepts:    the kinds of answer that it takes: ``motion`` (rotations), ``positions`` and/or ``surface``.
    stochastic: the result depends on ``context.seed``.
    """

    name: str
    summary: str
    version: str
    paper: str = ""
    licence: str = ""
    accepts: tuple[str, ...] = ("motion",)
    stochastic: bool = False
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Parameter name -> one line that says what it does and which values it takes."""


class Post(Protocol):
    """Turns a method's answer into another one."""

    card: PostCard

    def supports(self, source: Character, target: Character) -> str | None:
        """None, or the reason why answers of this pair cannot be worked on, as a sentence."""

    def process(self, prediction: Prediction, source: Any, *, context: Context) -> Prediction:
        """A motion of ``prediction.character``, the target: same frames, same rate.

        source: what the method was given, a ``Source``. context: the method's, with ``ground`` and without
        anything privileged.
        """


class Composed:
    """A method whose answers go through post-processors, one after the other.

    It needs, accepts and was trained on what the method is; it supports what all of them support, and takes
    batches where the method does; the post-processors take one case at a time.
    """

    def __init__(self, method: Method, posts: Sequence[Post]) -> None:
        self.method = method
        self.posts = tuple(posts)
        self.card = _card(method, self.posts)
        if takes_batches(method):
            self.retarget_batch = partial(self._batch, method)

    @property
    def weights_hash(self) -> str:
        return optional.weights_hash(self.method)

    @property
    def weights_label(self) -> str:
        return optional.weights_label(self.method)

    @property
    def stages(self) -> Mapping[str, Any]:
        return optional.stages(self.method)

    @property
    def training_manifest(self) -> Mapping[str, Sequence[str]] | None:
        return optional.method_manifest(self.method)

    def supports(self, source: Character, target: Character) -> str | None:
        if reason := self.method.supports(source, target):
            return reason
        each = ((post.card.name, post.supports(source, target)) for post in self.posts)
        return next((f"{name}: {reason}" for name, reason in each if reason), None)

    def retarget(self, source: Source, target: Character, *, context: Context) -> Prediction:
        answer = self.method.retarget(source.copy(), target, context=replace(context, ground=None))
        return self._processed(answer, source, target, context)

    def _processed(self, answer: object, source: Source, target: Character, context: Context) -> Prediction:
        """The answer after every post-processor. Raises NotSupported, and Invalid naming the plug-in."""
        case = Case(_NO_CASE, source, target)
        bare = Context(context.seed, context.device, context.precision, context.ground)
        found, before = verified(answer, case), self.method.card.name
        for post in self.posts:
            name = post.card.name
            kind, takes = kind_of(found), post.card.accepts
            if kind not in takes:
                raise NotSupported(f"{name} takes {' or '.join(takes)}, but {before} gives {kind} only")
            answer = post.process(found.copy(), source.copy(), context=bare)
            try:
                found, before = verified(answer, case), name
            except Invalid as error:
                raise Invalid(f"{name} {error}") from error
        return found

    def _batch(
        self,
        method: BatchMethod,
        sources: Sequence[Source],
        targets: Sequence[Character],
        *,
        contexts: Sequence[Context],
    ) -> list[Prediction]:
        copies = [source.copy() for source in sources]
        given = [replace(context, ground=None) for context in contexts]
        answers = method.retarget_batch(copies, targets, contexts=given)
        asked = zip(answers, sources, targets, contexts, strict=True)
        return [self._processed(*each) for each in asked]


_NO_CASE = CaseInfo("", "retarget", "", "", "", "")
"""An answer is looked at before it is known which case it is for."""


def _card(method: Method, posts: Sequence[Post]) -> MethodCard:
    """The method's card, with what follows it."""
    card = optional.method_card(method)
    cards = [post.card for post in posts]
    then = ", ".join(each.name for each in cards)
    return replace(
        card,
        name="+".join((card.name, *(each.name for each in cards))),
        summary=f"{card.summary}; then {then}".removeprefix("; "),
        version=", ".join((str(card.version), *(f"{each.name} {each.version}" for each in cards))),
        stochastic=bool(card.stochastic) or any(getattr(each, "stochastic", False) for each in cards),
        default=False,
        variants=(),
        reported={},
    )
