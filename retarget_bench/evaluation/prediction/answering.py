"""A prediction worker: questions in files, answers in files, and nothing else known.

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

import faulthandler
import gc
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from retarget_bench.api import Case, CaseInfo, Context, Method, Prediction
from retarget_bench.api.datasets import Cast
from retarget_bench.errors import BenchError, NotSupported, one_line
from retarget_bench.evaluation.predict import LazyClips, predict, predict_all
from retarget_bench.evaluation.prediction import apart
from retarget_bench.evaluation.prediction import question_files as files
from retarget_bench.evaluation.prediction.channel import Channel, Closed
from retarget_bench.evaluation.prediction.launch import adopt_orphans
from retarget_bench.evaluation.prediction.numpy_worker import end_with
from retarget_bench.evaluation.prediction.questions import CLIPS, MOTIONS
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec

NO_CASE = CaseInfo("", "retarget", "", "", "", "")
"""A method is not told which case it is asked."""


def begin(start: Mapping[str, Any], reading: int, writing: int) -> None:
    """Build the method and answer until the channel closes; never returns.

    start: ``method`` (its spec), ``plugins`` (files and kinds of plug-ins), ``folder`` (an empty one to
    work in) and ``log`` (the file that takes what is printed).
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    adopt_orphans()
    with suppress(AttributeError, PermissionError):  # where there is none, or it leads a group already
        os.setsid()  # whoever ends this process ends what it started
    _print_into(start["log"])
    channel = Channel(reading, writing)
    with suppress(Closed):
        channel.send(_ready(start, channel))
    os._exit(0)


def _ready(start: Mapping[str, Any], channel: Channel) -> dict[str, Any]:
    """Load the method and serve; a line with the reason where that is not possible."""
    try:
        registry.know_files(start["plugins"])
        method = registry.create("methods", Spec.parse(start["method"]))
        os.chdir(start["folder"])  # what a method writes or deletes by relative paths is its own
        method.warm_up()
        gc.freeze()  # memory that nobody writes to stays shared with the processes that answer
        # fitting to training motion takes long, and is to be done once
        forks = apart.possible() and "training" not in method.card.uses
        if not forks:
            end_with(channel.reading)
        channel.send({"ready": True, "forks": forks})
        AnsweringLoop(method, channel, Path(start["folder"])).serve(forks)
    except Closed:
        return {}
    except BenchError as error:
        return {"broken": str(error)}
    except (Exception, KeyboardInterrupt, SystemExit) as error:
        return {"broken": one_line(error)}
    return {}


def _print_into(log: str) -> None:
    """Standard output and errors of this process, and of what it starts, go to a file; input is empty."""
    nothing = os.open(os.devnull, os.O_RDONLY)
    printed = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    for target, source in ((0, nothing), (1, printed), (2, printed)):
        os.dup2(source, target)
    sys.stdout = open(1, "w", encoding="utf-8", errors="replace", closefd=False, buffering=1)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", errors="replace", closefd=False, buffering=1)  # noqa: SIM115
    faulthandler.enable(file=2)


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
            message = self.channel.receive()
            assert message is not None
            questions = message["ask"]
            if not forks:
                self._answer(questions)
                continue
            for question in questions:  # once for all processes to come
                for kind in ("source_character", "target_character"):
                    self.body(question[kind])
            how = apart.run_in_child(partial(self._answer, questions), self.folder, self.channel.reading)
            self.channel.send({"ended": how})

    def _answer(self, questions: Sequence[Mapping[str, Any]]) -> None:
        """Answer questions: write the predictions, and send the status of each."""
        process = os.getpid()
        try:
            cases = [self._case(question) for question in questions]
            contexts = [self._context(number, question) for number, question in enumerate(questions)]
        except files.Changed as error:
            self.channel.send(
                {"answers": [{"status": "changed", "message": str(error)} for _ in questions]}
            )
            return
        if len(cases) == 1:
            outcomes = [predict(self.method, cases[0], contexts[0])]
        else:
            outcomes = predict_all(self.method, cases, contexts)
        if os.getpid() != process:  # a method forked, and its child came back: one of them answers
            os._exit(0)
        answers = []
        for question, outcome in zip(questions, outcomes, strict=True):
            answer = {"status": outcome.status, "message": outcome.message}
            if outcome.prediction is not None:
                answer["digest"] = files.write_answer(Path(question["answer"]), outcome.prediction)
            answers.append(answer)
        self.channel.send({"answers": answers})

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
        arguments = dict(question["context"])
        for kind in MOTIONS:
            arguments[kind] = self._motion(arguments.get(kind))
        for kind in CLIPS:
            if kind in arguments:
                arguments[kind] = LazyClips(partial(self._clip, kind, number), range(arguments[kind]))
        if arguments.get("ground"):
            arguments["ground"] = files.ground(arguments["ground"])
        if arguments.get("training"):
            arguments["training"] = self.training
        return Context(**arguments)

    def _clip(self, kind: str, question: int, index: int) -> Prediction:
        """Raises NotSupported where there is no such motion."""
        motion = self._motion(self._requested({"give": kind, "question": question, "index": index}))
        assert motion is not None
        return motion

    @cached_property
    def training(self) -> Cast | None:
        index = self._requested({"give": "training", "question": 0})["index"]
        return files.read_training(Path(index), self.body) if index else None

    def _requested(self, request: dict[str, Any]) -> dict[str, Any]:
        self.channel.send(request)
        reply = self.channel.receive()
        assert reply is not None
        if "why" in reply:
            raise NotSupported(reply["why"])
        return reply

    def _motion(self, place: Mapping[str, str] | None) -> Prediction | None:
        return place and files.read_motion(Path(place["motion"]), self.body(place["character"]))  # type: ignore[return-value]

    def body(self, path: str) -> Character:
        """The body in a file. Raises Changed where it is not what was written."""
        if path not in self._bodies:
            self._bodies[path] = files.read_character(Path(path), lambda: self._mesh(path))
        return self._bodies[path]

    def _mesh(self, path: str) -> Mesh:
        try:
            return files.read_mesh(Path(self._requested({"give": "mesh", "character": path})["mesh"]))
        except OSError as error:
            raise BenchError(f"its mesh cannot be read ({error.strerror})") from error
