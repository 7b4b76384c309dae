"""Wraps a program of any language, which reads a folder of questions and writes its answers beside them."""

import json
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.prediction.environments import files_hash, in_full
from retarget_bench.exchange.case_export import CONVENTIONS, MANIFEST, SCHEMA, write_source, write_target
from retarget_bench.files import write_text
from retarget_bench.motion.character import Character
from retarget_bench.results.predictions import read_prediction


class External(Method):
    """Answers of ``command FOLDER``. The folder has the form of ``bench export --questions``: sources,
    bodies of targets, and a manifest that says how the answers are to be named (docs/plugins.md).

    The program is started once for several questions. Results are known by the contents of the files that
    the command names; where it names none, by ``version``.
    """

    card = MethodCard(
        name="external",
        summary="Answers of a program, asked by a folder of files",
        version="1",
        accepts=("motion", "positions"),
        default=False,
        parameters={
            "command": "what starts the program; the folder's path is put behind it",
            "version": "any text that changes with the program's answers; needed where no word is a file",
        },
    )

    def __init__(self, command: str, version: str = "") -> None:
        self.command = shlex.split(in_full(command))
        self.weights_hash = files_hash(self.command)
        if not self.command or not (version or self.weights_hash):
            raise BenchError(
                f"external: no word of {command!r} is a file that results could be known by; set version"
            )

    def supports(self, source: Character, target: Character) -> str | None:
        """The program is to decide."""
        return None

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        return self.retarget_batch([source], [target], contexts=[context])[0]

    def retarget_batch(
        self, sources: Sequence[Prediction], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> list[Prediction]:
        with TemporaryDirectory(ignore_cleanup_errors=True) as name:
            folder = Path(name)
            _write_questions(folder, sources, targets, contexts)
            self._run(folder)
            pairs = enumerate(zip(sources, targets, strict=True))
            return [_answer(folder, number, *each) for number, each in pairs]

    def _run(self, folder: Path) -> None:
        command = [*self.command, str(folder)]
        try:
            completed = subprocess.run(
                command, cwd=folder, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False
            )
        except OSError as error:
            raise BenchError(f"the program cannot be started ({error.strerror})") from error
        output = completed.stderr.decode(errors="replace")
        sys.stderr.write(output)
        if completed.returncode:
            last = next(
                (line.strip() for line in reversed(output.splitlines()) if line.strip()), "no message"
            )
            raise BenchError(f"the program ended with exit code {completed.returncode}: {last}")


def _write_questions(
    folder: Path,
    sources: Sequence[Prediction],
    targets: Sequence[Character],
    contexts: Sequence[Context],
) -> None:
    bodies: dict[int, str] = {}
    cases = []
    for number, (source, target, context) in enumerate(zip(sources, targets, contexts, strict=True)):
        if id(target) not in bodies:
            bodies[id(target)] = write_target(folder, f"{len(bodies)}-{target.name}", target)
        written = write_source(folder, str(number), source)
        files = {"source_file": written.pop("file"), "target_file": bodies[id(target)]}
        names = {"source": source.character.name, "target": target.name}
        cases.append({**names, **written, **files, "seed": context.seed, "prediction": str(number)})
    manifest = {"schema": SCHEMA, "conventions": CONVENTIONS, "cases": cases}
    write_text(folder / MANIFEST, json.dumps(manifest, indent=1, ensure_ascii=False) + "\n")


def _answer(folder: Path, number: int, source: Prediction, target: Character) -> Prediction:
    for path in (folder / f"{number}.npz", folder / f"{number}.bvh"):
        if path.exists():
            try:
                return read_prediction(path, target, source.fps)
            except FileError as error:
                raise BenchError(f"the program's answer {error.problem}") from error
    raise BenchError("the program wrote no answer")


plugin = External
