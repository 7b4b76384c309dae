"""Prediction workers from the scoring side: their start, questions, limits and end."""

import shlex
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from errno import EDQUOT, ENOSPC
from itertools import count
from pathlib import Path
from secrets import token_hex
from shutil import rmtree
from typing import Any

from retarget_bench.api import Case
from retarget_bench.errors import FileError
from retarget_bench.evaluation.predict import Outcome, differ
from retarget_bench.evaluation.prediction import environments, launch, numpy_worker
from retarget_bench.evaluation.prediction.channel import Closed, Nonsense
from retarget_bench.evaluation.prediction.limits import (
    FOLDER,
    LONGEST_LOG,
    PATIENCE,
    POLL,
    STARTING,
    Beyond,
    CannotStart,
    Disturbed,
    Late,
    Limits,
    Trouble,
    check_file,
    keep_printed,
    only,
    size_of,
    text,
)
from retarget_bench.evaluation.prediction.questions import Question, Questions
from retarget_bench.evaluation.prediction.turns import Turns
from retarget_bench.files import digest
from retarget_bench.plugins.prediction_check import Invalid, verified
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.predictions import read_prediction

THIS_PYTHON = shlex.quote(sys.executable)
"""The environment of this process."""
NONSENSE = "the method's process does not answer as it should"
STARTS = 3
"""So often a worker is started before its cases count as missing."""
AGAIN = 10
"""Of a method that answers all questions in one process, every tenth is asked again, in a fresh one."""
UNLIKE = "another answer when it was asked alone, in a fresh process: it depends on what was asked before"


class WorkerPool:
    """The workers of one scoring process, one for every method, and the processes that they are forked
    from: one for learned methods, and one for the others, which torch would make slow to fork.

    folder: of their questions and answers. shared: a folder of all scoring processes of the run on this
    machine.
    """

    def __init__(
        self, folder: Path, shared: Path, plugins: Sequence[tuple[str, str]], limits: Limits
    ) -> None:
        self.folder, self.plugins, self.limits = folder, plugins, limits
        self.turns = Turns(shared)
        self._mark = launch.new_mark()
        self._servers: dict[bool, launch.ForkServer] = {}
        self._workers: dict[Spec, PredictionWorker] = {}

    def worker(self, method: Spec, learned: bool = False) -> "PredictionWorker":
        """learned: it has weights."""
        if method not in self._workers:
            self._workers[method] = PredictionWorker(method, self, self.folder / token_hex(8), learned)
        return self._workers[method]

    def start(self, start: Mapping[str, Any], environment: str, lock: str, learned: bool) -> launch.Started:
        """Raises OSError and NoWorker."""
        log = Path(start["log"])
        if environment or self.limits.isolate:
            prefix = self.limits.prefix(log.parent)
            started, facts = environments.start(environment or THIS_PYTHON, log, self._mark, prefix)
            if lock not in ("", facts["lock"]):
                launch.end(started)
                raise environments.NoWorker(
                    f"{environment!r} is not the environment that the run began with ({lock}); run again"
                )
            started.channel.send({"start": start})
            return started
        if learned not in self._servers or not self._servers[learned].living:
            preload = launch.PRELOAD + learned * launch.LEARNED
            self._servers[learned] = launch.ForkServer(preload, self._mark)
        return self._servers[learned].start(start)

    def end_orphans(self) -> None:
        """Kill what workers that have ended left behind."""
        living = [each.pid for each in self._workers.values() if each.pid]
        launch.end_orphans(self._mark, living, [each.pid for each in self._servers.values()])

    def memory_of(self, pid: int) -> int:
        """Bytes of a worker that is answering, with all that it started."""
        living = {each.pid for each in self._workers.values()}
        adopted = [child for each in self._servers.values() for child in launch.children(each.pid)]
        return launch.memory_of([pid, *(each for each in adopted if each not in living)])

    def close(self) -> None:
        for each in self._workers.values():
            each.end()
        for server in self._servers.values():
            server.close()
        self._workers, self._servers = {}, {}
        self.end_orphans()
        self.turns.close()


@dataclass(eq=False)
class PredictionWorker:
    """The process of one method. It is started when it is asked, and again when it has ended.

    folder: for questions, answers and what the method writes. learned: it has weights.
    log: takes what it prints; None: nobody asks. lock: of another environment, if it is known.
    """

    method: Spec
    pool: WorkerPool
    folder: Path
    learned: bool
    log: Path | None = None
    lock: str = ""

    def __post_init__(self) -> None:
        self.limits = self.pool.limits
        self._started: launch.Started | None = None
        self._forks = False
        self._loaded = set[str]()  # what the method wrote while it was built
        self._seconds = 0.0  # that the last exchange took
        self._final: Outcome | None = None  # of every case from now on
        self._late = 0  # cases in a row without an answer in time
        self._folders = (self.folder.with_name(f"{self.folder.name}-{number}") for number in count())
        self._own_folder()

    def _own_folder(self) -> None:
        """A new folder for questions, answers and what the method writes, and no other."""
        rmtree(self.folder, ignore_errors=True)
        self.folder = next(self._folders)
        (self.folder / "work").mkdir(parents=True)
        self._questions = Questions(self.folder)
        self._printed = self.folder / "printed.txt"

    # ------------------------------------------------------------------------------------ asking
    def ask(self, questions: Sequence[Question]) -> list[Outcome]:
        """The verified outcome of every case; never an exception but OSError, where the disk is full.

        What was disturbed is asked once more while no other method is asked, since one may have
        disturbed it. Where several are asked together and that ends badly, each is asked on its own.
        Cases that nobody was asked are ``missing``, as are those after too many without an answer in
        time.
        """
        try:
            with self.pool.turns.together():
                outcomes = self._answers(questions)
            return self._asked_again(questions, outcomes)
        except Disturbed:
            pass
        except Trouble as trouble:
            return self._after_trouble(questions, trouble)
        try:
            with self.pool.turns.alone():
                return self._answers(questions)
        except Trouble as trouble:
            return self._after_trouble(questions, trouble)

    def ask_alone(self, questions: Sequence[Question]) -> tuple[list[Outcome], float]:
        """The same while no other method of the run is asked, and the seconds that it took, without those
        of starting the process."""
        self._seconds = 0.0
        with self.pool.turns.alone():
            try:
                return self._answers(questions), self._seconds
            except Trouble as trouble:
                return [Outcome("failed", str(trouble)) for _ in questions], self._seconds

    def _after_trouble(self, questions: Sequence[Question], trouble: Trouble) -> list[Outcome]:
        if isinstance(trouble, CannotStart):
            return [Outcome("missing", str(trouble)) for _ in questions]
        if len(questions) > 1 and self._final is None:
            return [outcome for each in questions for outcome in self.ask([each])]
        return [Outcome("failed", str(trouble)) for _ in questions]

    def _asked_again(self, questions: Sequence[Question], outcomes: list[Outcome]) -> list[Outcome]:
        """The outcomes, where every question had a process of its own. Else some are asked again, alone
        and in a fresh process; one that is answered otherwise then is no answer to its question."""
        if self._forks or self._started is None:
            return outcomes
        checked = list(outcomes)
        for number, (case, _) in enumerate(questions):
            before = outcomes[number].prediction
            if before is None or int(digest(case.info.id, 8), 16) % AGAIN:
                continue
            self.end()
            with self.pool.turns.together():
                (again,) = self._answers([questions[number]])
            if again.prediction is None or differ(before, again.prediction, case):
                checked[number] = Outcome("invalid", UNLIKE)
        return checked

    def end(self) -> None:
        if self._started is not None:
            launch.end(self._started)
            self._started = None
            self.pool.end_orphans()

    @property
    def pid(self) -> int:
        """Of the process; 0 while there is none."""
        return self._started.pid if self._started else 0

    # ------------------------------------------------------------------------------------ one exchange
    def _answers(self, questions: Sequence[Question]) -> list[Outcome]:
        """Raises Trouble, after which there is no process any more, and OSError."""
        if self._final is not None:
            return [self._final for _ in questions]
        try:
            outcomes = self._exchange(questions)
        except OSError as error:
            self.end()
            self._own_folder()  # what filled the disk may have been the method
            if error.errno in (ENOSPC, EDQUOT):
                raise
            raise Disturbed(f"the folder of its questions was changed ({error.strerror})") from error
        except Trouble:
            self.end()
            keep_printed(self._printed, self.log)
            self._own_folder()
            raise
        except BaseException:  # what its process says from now on would answer other questions
            self.end()
            raise
        self._late = 0
        keep_printed(self._printed, self.log)
        return outcomes

    def _exchange(self, questions: Sequence[Question]) -> list[Outcome]:
        if self._started is None:
            self._start()
        cases, begun = [case for case, _ in questions], time.perf_counter()
        try:
            requests = self._questions.write(questions)
            self._send({"ask": requests})
            answers = self._reply(self.limits.seconds(cases), len(cases))
            if not isinstance(answers, list) or len(answers) != len(cases):
                raise Beyond(NONSENSE)
            paths = [Path(request["answer"]) for request in requests]
            return [self._outcome(*each) for each in zip(cases, paths, answers, strict=True)]
        finally:
            self._seconds = time.perf_counter() - begun
            self._questions.remove()
            self._forget()

    def _forget(self) -> None:
        """Remove what a method wrote since it was built, where it answers each batch in a process of its
        own. Under a command that isolates it, it has places that are not seen from here: it ends."""
        own = self._questions.kept | {"work", self._printed.name}
        places = ((self.folder, own), (self.folder / "work", self._loaded))
        if self.limits.isolate or (self._forks and not all(only(*each) for each in places)):
            self.end()
            keep_printed(self._printed, self.log)
            self._own_folder()

    def _start(self) -> None:
        """Raises Beyond where the method cannot be built, CannotStart where no process comes to be."""
        start = {
            "method": str(self.method.here),
            "parameters": dict(self.method.parameters),
            "plugins": list(self.pool.plugins),
            "folder": str(self.folder / "work"),
            "log": str(self._printed),
        }
        for number in range(STARTS):
            try:
                self._started = self.pool.start(start, self.method.environment, self.lock, self.learned)
                message = self._receive(STARTING, f"the method was not built within {STARTING:g} s")
                break
            except (environments.NoWorker, Beyond) as error:
                raise self._hopeless(str(error)) from error
            except (OSError, Closed, Disturbed) as error:
                self.end()
                if isinstance(error, Disturbed) and number:  # it ends whenever it is built
                    raise self._hopeless(str(error)) from error
                if number == STARTS - 1:
                    raise CannotStart(f"the method's process cannot be started ({error})") from error
        self._forks = bool(message.get("forks"))
        self._loaded = {each.name for each in (self.folder / "work").iterdir()}
        if "ready" not in message:
            raise self._hopeless(text(message.get("broken", NONSENSE)))

    def _hopeless(self, why: str) -> Beyond:
        """The error to raise where the method can never be asked."""
        self._final = Outcome("failed", why)
        return Beyond(why)

    # ---------------------------------------------------------------------------------- answers
    def _reply(self, seconds: float, cases: int) -> Any:
        """Wait for the answers, and hand over the parts of questions that the method looks at."""
        until = time.monotonic() + seconds
        timeout = f"no answer within {seconds / cases:g} s a case (--timeout sets the limit)"
        answers = None
        while True:
            try:
                message = self._receive(until - time.monotonic(), timeout)
            except Late:
                self._late += 1
                if self._late >= PATIENCE:
                    why = f"not asked: {PATIENCE} cases before this got {timeout}"
                    self._final = Outcome("missing", why)
                raise
            if "answers" in message and answers is None:
                answers = message["answers"]
            elif "ended" in message:
                if answers is None:
                    how = text(message["ended"] or "without an answer")
                    raise Disturbed(f"the method's process ended ({how})")
            elif "answers" in message or "broken" in message:
                raise Beyond(text(message.get("broken", NONSENSE)))
            else:
                self._send(self._questions.handed_over(message))
            if answers is not None and ("ended" in message or not self._forks):
                return answers

    def _outcome(self, case: Case, path: Path, answer: Any) -> Outcome:
        """The answer in a file, if it is a motion that fits the case."""
        try:
            status, message = str(answer["status"]), text(answer["message"])
        except (KeyError, TypeError):
            raise Beyond(NONSENSE) from None
        if status == "changed":
            raise Disturbed(message)
        if status != "ok":
            return Outcome(status if status in ("unsupported", "invalid") else "failed", message)
        try:
            check_file(path, case)
            if "digest" not in answer:
                return Outcome("invalid", "the method's process does not tell the digest of its answer")
            if numpy_worker.digest(path.read_bytes()) != answer["digest"]:
                raise Disturbed("the answer was changed after it was written")
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

    def _receive(self, seconds: float, timeout: str) -> dict[str, Any]:
        """The next line. Raises Late after so many seconds, and Trouble."""
        started, until = self._started, time.monotonic() + seconds
        assert started is not None
        while True:
            left = until - time.monotonic()
            try:
                message = started.channel.receive(max(0.0, min(POLL, left)))
            except Nonsense as error:
                raise Beyond(f"the method's process cannot be understood: {error}") from error
            except Closed as error:
                raise Disturbed(self._how(started, str(error))) from error
            if message is not None:
                return message
            if how := started.ended():
                with suppress(Closed):  # its last words
                    if (message := started.channel.receive(0.0)) is not None:
                        return message
                raise Disturbed(f"the method's process ended ({how})")
            self._check_limits(started)
            if left <= 0:
                raise Late(timeout)

    def _check_limits(self, started: launch.Started) -> None:
        """Raises Beyond where the method takes more than it may."""
        keep_printed(self._printed, self.log, LONGEST_LOG)
        if size_of(self.folder / "work") > FOLDER:
            raise Beyond(f"the method wrote more than {FOLDER / 2**30:.3g} GB of files")
        if self.limits.memory and self.pool.memory_of(started.pid) > self.limits.memory:
            allowed = self.limits.memory / 2**30
            raise Beyond(f"the method took more than {allowed:.3g} GB of memory (--memory sets the limit)")

    @staticmethod
    def _how(started: launch.Started, closed: str) -> str:
        for _ in range(20):
            if how := started.ended():
                return f"the method's process ended ({how})"
            time.sleep(0.05)
        return f"the method's process cannot be talked to: {closed}"
