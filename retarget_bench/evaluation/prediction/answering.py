"""The loop of a prediction worker: questions in files, answers in files, and nothing else known.

A line asks for some cases, the answer to it says how each went:

    {"ask": [question, ...], "repeat": 1}
    {"answers": [{"status": "ok", "message": "", "seconds": 0.02}, ...]}

A question names the files of its source, of both bodies and of the answer, and gives the context. What is
large or rarely used (clips of a card's ``needs``, training motion, meshes) is asked for when a method looks
at it, with a line that is answered by the name of a file:

    {"give": "other_clips", "question": 0, "index": 3}
    {"motion": "...npz", "character": "...json"}
"""

import json
import os
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from retarget_bench.api import Case, CaseInfo, Context, Method, Prediction
from retarget_bench.api.datasets import Cast
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation.predict import Outcome, predict, predict_all
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

    def __init__(self, desk: "Desk", kind: str, question: int, indices: range) -> None:
        self._desk, self._kind, self._question, self._indices = desk, kind, question, indices

    def __len__(self) -> int:
        return len(self._indices)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return GivenClips(self._desk, self._kind, self._question, self._indices[index])
        return self._desk.clip(self._kind, self._question, self._indices[index])


@dataclass(eq=False)
class Desk:
    """A method and the channel over which it is asked. Bodies and training motion are read once."""

    method: Method
    channel: Channel

    def __post_init__(self) -> None:
        self._bodies: dict[str, Character] = {}
        self._process = os.getpid()

    def serve(self) -> None:
        """Answer until the channel closes."""
        while True:
            asked = self.channel.receive()
            assert asked is not None
            answers = self.answer(asked["ask"], asked.get("repeat", 1))
            sys.stdout.flush()
            sys.stderr.flush()
            self.channel.send({"answers": answers})

    def answer(self, questions: Sequence[Mapping[str, Any]], repeat: int = 1) -> list[dict[str, Any]]:
        """How each question went; of predictions, the file is written. repeat: ask so many times, and give
        the middle of the times."""
        cases = [self._case(question) for question in questions]
        contexts = [self._context(number, question) for number, question in enumerate(questions)]
        taken = []
        for _ in range(repeat):
            start = time.perf_counter()
            outcomes = self._asked(cases, contexts)
            taken.append((time.perf_counter() - start) / len(cases))
        if os.getpid() != self._process:  # a method forked, and its child came back: one of them answers
            os._exit(0)
        found = []
        for question, outcome in zip(questions, outcomes, strict=True):
            if outcome.prediction is not None:
                files.write_answer(Path(question["answer"]), outcome.prediction)
            said = {"status": outcome.status, "message": outcome.message}
            found.append(said | {"seconds": sorted(taken)[len(taken) // 2]})
        return found

    def _asked(self, cases: Sequence[Case], contexts: Sequence[Context]) -> list[Outcome]:
        if len(cases) == 1:
            return [predict(self.method, cases[0], contexts[0])]
        return predict_all(self.method, cases, contexts)

    def _case(self, question: Mapping[str, Any]) -> Case:
        source = files.read_source(Path(question["source"]), self._body(question["source_character"]))
        context = question["context"]
        return Case(
            NO_CASE,
            source,
            self._body(question["target_character"]),
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
        folder = self._given({"give": "training", "question": 0})["folder"]
        return files.read_training(Path(folder), self._body) if folder else None

    def _given(self, wish: dict[str, Any]) -> dict[str, Any]:
        self.channel.send(wish)
        found = self.channel.receive()
        assert found is not None
        if "why" in found:
            raise NotSupported(found["why"])
        return found

    def _motion(self, place: Mapping[str, str] | None) -> Prediction | None:
        return place and files.read_motion(Path(place["motion"]), self._body(place["character"]))  # type: ignore[return-value]

    def _body(self, path: str) -> Character:
        if path not in self._bodies:
            facts = json.loads(Path(path).read_text(encoding="utf-8"))
            self._bodies[path] = files.character(facts, lambda: self._mesh(path))
        return self._bodies[path]

    def _mesh(self, path: str) -> Mesh:
        try:
            return files.read_mesh(Path(self._given({"give": "mesh", "character": path})["mesh"]))
        except OSError as error:
            raise BenchError(f"its mesh cannot be read ({error.strerror})") from error
