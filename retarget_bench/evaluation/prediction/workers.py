"""Prediction workers as the scoring side sees them: asked by files, limited in time and memory, ended."""

import os
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from errno import ENOSPC
from itertools import count
from pathlib import Path
from secrets import token_hex
from typing import Any

from retarget_bench.api import Case, Context
from retarget_bench.errors import FileError, NotSupported
from retarget_bench.evaluation.predict import Outcome, read_prediction
from retarget_bench.evaluation.prediction import environments, launch
from retarget_bench.evaluation.prediction import question_files as files
from retarget_bench.evaluation.prediction.channel import Closed, Nonsense
from retarget_bench.evaluation.prediction.limits import (
    LONGEST_LOG,
    LOOK,
    PATIENCE,
    STARTING,
    Beyond,
    Late,
    Limits,
    Trouble,
    check_file,
    text,
)
from retarget_bench.plugins.prediction_check import Invalid, verified
from retarget_bench.plugins.spec import Spec

NONSENSE = "the method's process does not answer as it should"
PRELOAD = (
    "retarget_bench.evaluation.prediction.starting",
    "retarget_bench.motion.planting",
    "retarget_bench.motion.transfer",
    "importlib.metadata",
)
"""What all workers import, or nearly all."""
LEARNED = (
    "torch",
    "retarget_bench.training.learned_method",
    "retarget_bench.training.data",
    "retarget_bench.motion.aligned",
)
"""What is added where a method of the plan has weights."""

Asked = tuple[Case, Context]


class Crew:
    """The workers of one scoring process, one for every method, and the process that they are forked from.

    folder: of their questions and answers. preload: modules that all of them begin with.
    """

    def __init__(
        self, folder: Path, plugins: Sequence[tuple[str, str]], limits: Limits, preload: Sequence[str] = ()
    ) -> None:
        self.folder, self.plugins, self.limits = folder, plugins, limits
        self._preload, self._mark = (*PRELOAD, *preload), launch.new_mark()
        self._template: launch.Template | None = None
        self._workers: dict[Spec, PredictionWorker] = {}

    def worker(self, method: Spec) -> "PredictionWorker":
        if method not in self._workers:
            folder = self.folder / str(len(self._workers))
            self._workers[method] = PredictionWorker(method, self, folder)
        return self._workers[method]

    def start(self, start: Mapping[str, Any], environment: str, lock: str) -> launch.Started:
        """Raises OSError and CannotStart."""
        if environment:
            started, facts = environments.start(environment, Path(start["log"]), self._mark)
            if lock not in ("", facts["lock"]):
                launch.end(started)
                raise environments.CannotStart(
                    f"{environment!r} is not the environment that the run began with ({lock}); run again"
                )
            started.channel.send({"start": start})
            return started
        if self._template is None or not self._template.living:
            self._template = launch.Template(self._preload, self._mark)
        return self._template.start(start)

    def end_orphans(self) -> None:
        """Kill what workers that have ended left behind."""
        living = [each.pid for each in self._workers.values() if each.pid]
        launch.end_orphans(self._mark, living, self._template.pid if self._template else 0)

    def memory_of(self, pid: int) -> int:
        """Bytes of a worker that is answering, with all that it started."""
        living = {each.pid for each in self._workers.values()}
        adopted = launch.children(self._template.pid) if self._template else []
        return launch.memory_of([pid, *(each for each in adopted if each not in living)])

    def close(self) -> None:
        for each in self._workers.values():
            each.end()
        if self._template is not None:
            self._template.close()
        self._workers, self._template = {}, None
        self.end_orphans()


@dataclass(eq=False)
class PredictionWorker:
    """The process of one method. It is started when it is asked, and again when it has ended.

    folder: for questions, answers and what the method writes. log: takes what it prints; None: nobody asks.
    lock: of another environment, if it is known.
    """

    method: Spec
    crew: Crew
    folder: Path
    log: Path | None = None
    lock: str = ""
    seconds: float = field(default=0.0, init=False)
    """Of the last answer, as the worker measured it, for each case."""

    def __post_init__(self) -> None:
        self.limits = self.crew.limits
        self._started: launch.Started | None = None
        self._hopeless = ""
        self._late = 0  # cases in a row without an answer in time
        self._starts = 0  # attempts in a row that ended before the method was built
        self._given_up = ""
        self._questions: Sequence[Asked] = ()
        self._written: list[Path] = []  # files of what is being asked
        self._folders = (self.folder / str(number) for number in count())
        self._own_folder()

    def _own_folder(self) -> None:
        """A new folder for questions, answers and what the method writes."""
        self.folder = next(self._folders)
        (self.folder / "work").mkdir(parents=True)
        self._printed = self.folder / "printed.txt"

    def _new_path(self) -> Path:
        """Of a file that the method cannot have put something else in the place of beforehand, and that is
        removed when the question is answered."""
        self._written.append(self.folder / f"{token_hex(8)}.npz")
        return self._written[-1]

    def ask(self, asked: Sequence[Asked], repeat: int = 1) -> list[Outcome]:
        """The verified outcome of every case; never an exception but OSError, where the disk is full.
        After too many cases without an answer in time it is ``missing``: another run may ask again.

        A process that ends is asked once more, since somebody else may have killed it. Where several are
        asked together and that ends badly, each is asked on its own.
        """
        trouble: Trouble | None = None
        for _ in range(2):
            if self._given_up:
                return [Outcome("missing", self._given_up) for _ in asked]
            if self._hopeless:
                return [Outcome("failed", self._hopeless) for _ in asked]
            try:
                outcomes = self._exchange(asked, repeat)
            except OSError as error:
                self.end()
                if error.errno == ENOSPC:
                    raise
                self._own_folder()
                trouble = Beyond(f"the folder of its questions was changed ({error.strerror})")
                break
            except Trouble as error:
                trouble = error
                self.end()
                self._keep_log()
                if isinstance(error, Beyond):
                    break
            except BaseException:  # what its process says from now on would answer other questions
                self.end()
                raise
            else:
                self._late = 0
                self._keep_log()
                return outcomes
        if len(asked) > 1 and not self._hopeless and not self._given_up:
            return [outcome for each in asked for outcome in self.ask([each], repeat)]
        return [Outcome("failed", str(trouble)) for _ in asked]

    def end(self) -> None:
        if self._started is not None:
            launch.end(self._started)
            self._started = None
            self.crew.end_orphans()

    @property
    def pid(self) -> int:
        """Of the process; 0 while there is none."""
        return self._started.pid if self._started else 0

    # ------------------------------------------------------------------------------------ asking
    def _exchange(self, asked: Sequence[Asked], repeat: int) -> list[Outcome]:
        if self._started is None:
            self._start()
        self._questions, cases = asked, [case for case, _ in asked]
        try:
            questions = [self._question(*each) for each in asked]
            self._send({"ask": questions, "repeat": repeat})
            said = self._reply(repeat * self.limits.seconds(cases), len(cases))["answers"]
            if not isinstance(said, list) or len(said) != len(cases):
                raise Beyond(NONSENSE)
            paths = [Path(question["answer"]) for question in questions]
            return [self._outcome(*each) for each in zip(cases, paths, said, strict=True)]
        finally:
            for path in self._written:
                with suppress(OSError):
                    path.unlink()
            self._written.clear()

    def _start(self) -> None:
        start = {
            "method": str(self.method.here),
            "parameters": dict(self.method.parameters),
            "plugins": list(self.crew.plugins),
            "folder": str(self.folder / "work"),
            "log": str(self._printed),
        }
        try:
            self._started = self.crew.start(start, self.method.environment, self.lock)
        except environments.CannotStart as error:
            self._hopeless = str(error)
            raise Trouble(self._hopeless) from error
        except (OSError, Closed) as error:
            raise Trouble(f"the method's process cannot be started ({error})") from error
        try:
            said = self._receive(STARTING, f"the method was not built within {STARTING:g} s")
        except Trouble as trouble:
            self._starts += 1
            if isinstance(trouble, Beyond) or self._starts > 1:
                self._hopeless = str(trouble)
            raise
        self._starts = 0
        if "ready" not in said:
            self._hopeless = text(said.get("broken", NONSENSE))
            raise Beyond(self._hopeless)

    def _question(self, case: Case, context: Context) -> dict[str, Any]:
        source = files.write_motion(self._new_path(), case.source)
        return {
            "source": str(source),
            "source_character": str(files.write_character(self.folder, case.source.character)),
            "target_character": str(files.write_character(self.folder, case.target)),
            "answer": str(self._new_path()),
            "context": self._context(context),
        }

    def _context(self, context: Context) -> dict[str, Any]:
        """What a method may know, as JSON; clips and training motion are handed over when asked for."""
        said: dict[str, Any] = {
            "seed": context.seed,
            "device": context.device,
            "precision": context.precision,
        }
        if context.training is not None:
            said["training"] = True
        if context.ground is not None:
            said["ground"] = files.ground_facts(context.ground)
        for kind in ("reference", "second_reference", "source_motion"):
            if (motion := getattr(context, kind)) is not None:
                said[kind] = self._place(motion)
        for kind in ("other_clips", "target_motions"):
            if (clips := getattr(context, kind)) is not None:
                said[kind] = len(clips)
        return said

    def _place(self, motion: Any) -> dict[str, str]:
        body = files.write_character(self.folder, motion.character)
        return {"motion": str(files.write_motion(self._new_path(), motion)), "character": str(body)}

    # ---------------------------------------------------------------------------------- answers
    def _reply(self, seconds: float, cases: int) -> dict[str, Any]:
        """The line with the answers; until it comes, what the method looks at is handed over."""
        until = time.monotonic() + seconds
        late = f"no answer within {seconds / cases:g} s a case (--timeout sets the limit)"
        while True:
            try:
                said = self._receive(until - time.monotonic(), late)
            except Late:
                self._late += 1
                if self._late >= PATIENCE:
                    self._given_up = f"not asked: {PATIENCE} cases before this got {late}"
                raise
            if "answers" in said:
                return said
            if "broken" in said:
                raise Beyond(text(said["broken"]))
            self._send(self._given(said))

    def _given(self, wish: Mapping[str, Any]) -> dict[str, Any]:
        try:
            kind, (case, context) = wish["give"], self._questions[int(wish.get("question", 0))]
            if kind == "training":
                if context.training is None:
                    return {"folder": None}
                return {"folder": str(files.write_training(self.folder / "training", context.training))}
            if kind == "mesh":
                moved = (case.source, context.source_motion, context.reference, context.second_reference)
                bodies = (case.target, *(each.character for each in moved if each is not None))
                here = {str(files.write_character(self.folder, body)): body for body in bodies}
                mesh = here[wish["character"]].mesh
                assert mesh is not None
                return {"mesh": str(files.write_mesh(self._new_path(), mesh))}
            if kind not in ("other_clips", "target_motions"):
                raise KeyError(kind)
            clip = getattr(context, kind)[int(wish["index"])]
            return self._place(clip)
        except NotSupported as error:
            return {"why": str(error)}
        except (KeyError, IndexError, TypeError, ValueError, AssertionError, OverflowError) as error:
            raise Beyond(f"the method's process asks for what there is not ({error})") from error

    def _outcome(self, case: Case, path: Path, said: Any) -> Outcome:
        """The answer in a file, if it is a motion that fits the case."""
        try:
            status, message = str(said["status"]), text(said["message"])
            self.seconds = float(said["seconds"])
        except (KeyError, TypeError, ValueError):
            raise Beyond(NONSENSE) from None
        if status != "ok":
            known = status if status in ("unsupported", "invalid") else "failed"
            return Outcome(known, message)
        try:
            check_file(path, case)
            return Outcome(
                "ok", prediction=verified(read_prediction(path, case.target, case.source.fps), case)
            )
        except (Invalid, FileError) as error:
            return Outcome("invalid", str(error).replace(str(path), "the answer"))

    # ----------------------------------------------------------------------------------- limits
    def _send(self, message: dict[str, Any]) -> None:
        assert self._started is not None
        with suppress(Closed):  # told with its reason by what is received next
            self._started.channel.send(message)

    def _receive(self, seconds: float, late: str) -> dict[str, Any]:
        """The next line. Raises Late after so many seconds, and Trouble."""
        started, until = self._started, time.monotonic() + seconds
        assert started is not None
        while True:
            left = until - time.monotonic()
            try:
                said = started.channel.receive(max(0.0, min(LOOK, left)))
            except Nonsense as error:
                raise Beyond(f"the method's process cannot be understood: {error}") from error
            except Closed as error:
                raise Trouble(self._how(started, str(error))) from error
            if said is not None:
                return said
            if how := started.ended():
                with suppress(Closed):  # its last words
                    if (said := started.channel.receive(0.0)) is not None:
                        return said
                raise Trouble(f"the method's process ended ({how})")
            if self._printed_much():
                self._keep_log()
            if self.limits.memory and self.crew.memory_of(started.pid) > self.limits.memory:
                allowed = self.limits.memory / 2**30
                raise Beyond(
                    f"the method took more than {allowed:.3g} GB of memory (--memory sets the limit)"
                )
            if left <= 0:
                raise Late(late)

    @staticmethod
    def _how(started: launch.Started, closed: str) -> str:
        for _ in range(20):
            if how := started.ended():
                return f"the method's process ended ({how})"
            time.sleep(0.05)
        return f"the method's process cannot be talked to: {closed}"

    def _printed_much(self) -> bool:
        with suppress(OSError):
            return self._printed.stat().st_size > LONGEST_LOG
        return False

    def _keep_log(self) -> None:
        """Bring what was printed to the log, up to its limit."""
        with suppress(OSError):
            if not (length := self._printed.stat().st_size):
                return
            kept = self.log.stat().st_size if self.log is not None and self.log.exists() else 0
            if self.log is not None and kept < LONGEST_LOG:
                self.log.parent.mkdir(parents=True, exist_ok=True)
                with self._printed.open("rb") as printed, self.log.open("ab") as log:
                    log.write(printed.read(LONGEST_LOG - kept))
                    if length > LONGEST_LOG - kept:
                        log.write(b"\n... what came after this is not kept\n")
            os.truncate(self._printed, 0)
