"""Post-processors, which change the answers of any method, and methods composed with them.

``pan+footfix`` is the method ``pan`` whose every answer goes through the post-processor ``footfix``;
``a+b+c`` goes through ``b``, then ``c``. A post-processor is a plug-in like any other: a callable that
takes its parameters as keywords and returns an object of the shape of ``Post``. It is asked once per
answer, sees what the method could see without privileges, and the floor; never the reference.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from retarget_bench.api import Case, CaseInfo, Context, Method, MethodCard, Prediction, Source
from retarget_bench.api.completing import words
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import kind_of
from retarget_bench.plugins.prediction_check import Invalid, verified

RECONSTRUCTION = "reconstruction"
OF_TARGET = {"reference", "second_reference", "target_motions", "other_clips"}
"""Privileged inputs of methods that are about the target's body."""


@dataclass(frozen=True)
class PostCard:
    """Description of a post-processor, and the answers that it works on.

    accepts:    the kinds of answer that it takes: ``motion`` (rotations), ``positions`` and/or ``surface``.
    needs:      ``reconstruction``: ``context.reconstruction`` is given, which costs a second answer.
    stochastic: the result depends on ``context.seed``.
    """

    name: str
    summary: str
    version: str
    paper: str = ""
    licence: str = ""
    accepts: tuple[str, ...] = ("motion",)
    needs: tuple[str, ...] = ()
    stochastic: bool = False
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Parameter name -> one line that says what it does and which values it takes."""

    def __post_init__(self) -> None:
        words(self, "needs")


class Post(ABC):
    """Turns a method's answer into another one.

    follows:   the root rule whose paths it changes: it is refused after others; "": any.
    root_rule: that of its answers; "": the method's.
    """

    card: PostCard
    follows: str = ""
    root_rule: str = ""

    @abstractmethod
    def supports(self, source: Character, target: Character) -> str | None:
        """None, or the reason why answers of this pair cannot be worked on, as a sentence."""

    @abstractmethod
    def process(self, prediction: Prediction, source: Any, *, context: Context) -> Prediction:
        """A motion of ``prediction.character``, the target: same frames, same rate.

        source: what the method was given, a ``Source``. context: the method's, with ``ground``, what the
        card needs, and without anything privileged.
        """

    def warm_up(self) -> None:  # noqa: B027
        """As of a ``Method``."""


class Composed(Method):
    """A method whose answers go through post-processors, one after the other.

    It needs, accepts and was trained on what the method is; it supports what all of them support, and takes
    batches where the method does; the post-processors take one case at a time.
    """

    def __init__(self, method: Method, posts: Sequence[Post]) -> None:
        self.method = method
        self.posts = tuple(posts)
        self.card = _card(method, self.posts)
        needing = [n for n, post in enumerate(self.posts, 1) if RECONSTRUCTION in post.card.needs]
        self._twice = self.posts[: max(needing, default=0)]
        self.root_rule = self._rule(len(self.posts))
        """That of the last post-processor that moves the path, else the method's."""
        if method.retarget_batch is not None:
            self.retarget_batch = partial(self._batch, method.retarget_batch)

    @property
    def weights_hash(self) -> str:
        return self.method.weights_hash

    @property
    def weights_label(self) -> str:
        return self.method.weights_label

    @property
    def stages(self) -> Mapping[str, Any]:
        return self.method.stages

    def warm_up(self) -> None:
        self.method.warm_up()
        for post in self.posts:
            post.warm_up()

    @property
    def training_manifest(self) -> Mapping[str, Sequence[str]] | None:
        return self.method.training_manifest

    def supports(self, source: Character, target: Character) -> str | None:
        pairs = [(target, self.posts)]
        if self._twice:
            post, privileged = (
                self._twice[-1].card.name,
                OF_TARGET & set(self.method.card.needs),
            )
            if privileged:
                return (
                    f"{post} asks for the source's own body, too, and {self.card.name.partition('+')[0]} "
                    f"sees {', '.join(sorted(privileged))} of the target"
                )
            pairs.append((source, self._twice))
        return next((why for body, posts in pairs if (why := self._reason(source, body, posts))), None)

    def _reason(self, source: Character, body: Character, posts: Sequence[Post]) -> str | None:
        if reason := self.method.supports(source, body):
            return reason
        for number, post in enumerate(posts):
            before, expected = self._rule(number), post.follows
            if expected not in ("", before):
                given = f"follow {before}" if before else "come without a root rule"
                return f"{post.card.name}: changes paths that follow {expected}; those it is given {given}"
            if reason := post.supports(source, body):
                return f"{post.card.name}: {reason}"
        return None

    def _rule(self, posts: int) -> str:
        """The root rule of the answer after so many post-processors; "" where it is not known."""
        rules = (*(post.root_rule for post in reversed(self.posts[:posts])), self.method.root_rule)
        return next(filter(None, rules), "")

    def retarget(self, source: Source, target: Character, *, context: Context) -> Prediction:
        bare = replace(context, ground=None)
        answer = self.method.retarget(source.copy(), target, context=bare)
        (own,) = self._reconstructed([source], [target], [bare])
        return self._processed(answer, own, source, target, context)

    def _reconstructed(
        self, sources: Sequence[Source], targets: Sequence[Character], contexts: Sequence[Context]
    ) -> Sequence[object]:
        """The method's answer to every source on its own body, None where no post-processor needs it."""
        if not self._twice:
            return [None] * len(sources)
        copies = [each.copy() for each in sources]
        return self.method.reconstruct_batch(copies, targets, contexts=contexts)

    def _processed(
        self, answer: object, own: object, source: Source, target: Character, context: Context
    ) -> Prediction:
        """The answer after every post-processor; ``own`` goes with it as far as it is needed.

        Raises NotSupported, and Invalid naming the plug-in."""
        bare = Context(context.seed, context.device, context.precision, context.ground)
        case, again = Case(_NO_CASE, source, target), Case(_NO_CASE, source, source.character)
        prediction, before = verified(answer, case), self.method.card.name
        reconstruction = (
            _verified(own, again, "asked for the source's own body, it") if self._twice else None
        )
        for number, post in enumerate(self.posts, 1):
            post_context = bare
            if reconstruction is not None and RECONSTRUCTION in post.card.needs:
                post_context = replace(bare, reconstruction=reconstruction.copy())
            prediction = _through(post, prediction, before, case, post_context)
            if reconstruction is not None and number < len(self._twice):
                reconstruction = _through(post, reconstruction, before, again, post_context)
            before = post.card.name
        return prediction

    def _batch(
        self,
        asked: Callable[..., Sequence[Prediction]],
        sources: Sequence[Source],
        targets: Sequence[Character],
        *,
        contexts: Sequence[Context],
    ) -> list[Prediction]:
        copies = [source.copy() for source in sources]
        bare = [replace(context, ground=None) for context in contexts]
        answers = asked(copies, targets, contexts=bare)
        own = self._reconstructed(sources, targets, bare)
        questions = zip(answers, own, sources, targets, contexts, strict=True)
        return [self._processed(*each) for each in questions]


def _through(post: Post, prediction: Prediction, before: str, case: Case, context: Context) -> Prediction:
    """A prediction after a post-processor. before: the name of the plug-in that gave it."""
    name, kind, takes = post.card.name, kind_of(prediction), post.card.accepts
    if kind not in takes:
        raise NotSupported(f"{name} takes {' or '.join(takes)}, but {before} gives {kind} only")
    return _verified(post.process(prediction.copy(), case.source.copy(), context=context), case, name)


def _verified(answer: object, case: Case, subject: str) -> Prediction:
    """A valid answer. Raises Invalid that begins with a subject."""
    try:
        return verified(answer, case)
    except Invalid as error:
        raise Invalid(f"{subject} {error}") from error


_NO_CASE = CaseInfo("", "retarget", "", "", "", "")
"""An answer is looked at before it is known which case it is for."""


def _card(method: Method, posts: Sequence[Post]) -> MethodCard:
    """The method's card, with what follows it."""
    card = method.card
    cards = [post.card for post in posts]
    then = ", ".join(each.name for each in cards)
    return replace(
        card,
        name="+".join((card.name, *(each.name for each in cards))),
        summary=f"{card.summary}; then {then}".removeprefix("; "),
        version=", ".join((str(card.version), *(f"{each.name} {each.version}" for each in cards))),
        stochastic=bool(card.stochastic) or any(each.stochastic for each in cards),
        default=False,
        variants=(),
    )
