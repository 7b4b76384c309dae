"""The loop of a prediction worker: questions in files, answers in files, and nothing else known.

A line asks for some cases, the answer to it says how each went:

    {"ask": [question, ...]}
    {"answers": [{"status": "ok", "message": "", "digest": "0f3a..."}, ...]}
    {"ended": ""}

A question names the files of its source, of both bodies and of the answer, and gives the context; the
digest is that of the answer's file. A worker that said of itself that it ``forks`` answers by a process
of its own (``apart.py``), and tells how that ended. What is large or rarely used (clips of a card's
``needs``, training motion, meshes) is asked for when a method looks at it, with a line that is answered
by the name of a file:

    {"give": "other_clips", "question": 0, "index": 3}
    {"motion": "...npz", "character": "...json"}
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from retarget_bench.api import Case, CaseInfo, Context, Method, Prediction
from retarget_bench.api.datasets import Cast
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation.predict import Outcome, predict, predict_all
from retarget_bench.evaluation.prediction import apart
from retarget_bench.evaluation.prediction import question_files as files
from retarget_bench.evaluation.prediction.channel import Channel
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh

NO_CASE = CaseInfo("", "retarget", "", "", "", "")
"""A method is not told which case it is asked."""
CLIPS = ("other_clips", "target_motions")
MOTIONS = ("reference", "second_reference", "source_motion")


class GivenClips(Sequence[Prediction]):
    """Motions that the asking process reads and hands over when they are indexed."""

    def __init__(self, loop: "AnsweringLoop", kind: str, question: int, indices: range) -> None:
        self._loop, self._kind, self._question, self._indices = loop, kind, question, indices

    def __len__(self) -> int:
        return len(self._indices)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return GivenClips(self._loop, self._kind, self._question, self._indices[index])
        return self._loop.clip(self._kind, self._question, self._indices[index])


@dataclass(eq=False)
class AnsweringLoop:
    """A method and the channel over which it is asked. Bodies are read once, and so is training motion.

    folder: an empty one to work in.
    """

    method: Method
    channel: Channel
    folder: Path

    def __post_init__(self) -> None:
        self._bodies: dict[str, Character] = {}

    def serve(self, forks: bool) -> None:
        """Answer until the channel closes. forks: in a process of its own for every line."""
        while True:
            asked = self.channel.receive()
            assert asked is not None
            questions = asked["ask"]
            if not forks:
                self._answer(questions)
                continue
            for question in questions:  # once for all processes to come
                for kind in ("source_character", "target_character"):
                    self.body(question[kind])
            how = apart.carried_out(partial(self._answer, questions), self.folder, self.channel.reading)
            self.channel.send({"ended": how})

    def _answer(self, questions: Sequence[Mapping[str, Any]]) -> None:
        """Say how each question went; of predictions, the file is written."""
        mine = os.getpid()
        try:
            cases = [self._case(question) for question in questions]
            contexts = [self._context(number, question) for number, question in enumerate(questions)]
        except files.Changed as error:
            self.channel.send(
                {"answers": [{"status": "changed", "message": str(error)} for _ in questions]}
            )
            return
        outcomes = self._asked(cases, contexts)
        if os.getpid() != mine:  # a method forked, and its child came back: one of them answers
            os._exit(0)
        found = []
        for question, outcome in zip(questions, outcomes, strict=True):
            said = {"status": outcome.status, "message": outcome.message}
            if outcome.prediction is not None:
                said["digest"] = files.write_answer(Path(question["answer"]), outcome.prediction)
            found.append(said)
        self.channel.send({"answers": found})

    def _asked(self, cases: Sequence[Case], contexts: Sequence[Context]) -> list[Outcome]:
        if len(cases) == 1:
            return [predict(self.method, cases[0], contexts[0])]
        return predict_all(self.method, cases, contexts)

    def _case(self, question: Mapping[str, Any]) -> Case:
        source = files.read_source(Path(question["source"]), self.body(question["source_character"]))
        context = question["context"]
        return Case(
            NO_CASE,
            source,
            self.body(question["target_character"]),
            reference=self._motion(context.get("reference")),
            alternative=self._motion(context.get("second_reference")),
            source_motion=self._motion(context.get("source_motion")),  # type: ignore[arg-type]
        )

    def _context(self, number: int, question: Mapping[str, Any]) -> Context:
        given = dict(question["context"])
        for kind in MOTIONS:
            given[kind] = self._motion(given.get(kind))
        for kind in CLIPS:
            if kind in given:
                given[kind] = GivenClips(self, kind, number, range(given[kind]))
        if given.get("ground"):
            given["ground"] = files.ground(given["ground"])
        if given.get("training"):
            given["training"] = self.training
        return Context(**given)

    def clip(self, kind: str, question: int, index: int) -> Prediction:
        """Raises NotSupported where there is no such motion."""
        found = self._motion(self._given({"give": kind, "question": question, "index": index}))
        assert found is not None
        return found

    @cached_property
    def training(self) -> Cast | None:
        index = self._given({"give": "training", "question": 0})["index"]
        return files.read_training(Path(index), self.body) if index else None

    def _given(self, wish: dict[str, Any]) -> dict[str, Any]:
        self.channel.send(wish)
        found = self.channel.receive()
        assert found is not None
        if "why" in found:
            raise NotSupported(found["why"])
        return found

    def _motion(self, place: Mapping[str, str] | None) -> Prediction | None:
        return place and files.read_motion(Path(place["motion"]), self.body(place["character"]))  # type: ignore[return-value]

    def body(self, path: str) -> Character:
        """The body in a file. Raises Changed where it is not what was written."""
        if path not in self._bodies:
            self._bodies[path] = files.read_character(Path(path), lambda: self._mesh(path))
        return self._bodies[path]

    def _mesh(self, path: str) -> Mesh:
        try:
            return files.read_mesh(Path(self._given({"give": "mesh", "character": path})["mesh"]))
        except OSError as error:
            raise BenchError(f"its mesh cannot be read ({error.strerror})") from error
