"""The questions to a worker: their files, and parts that are handed over when a method looks at them."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from secrets import token_hex
from typing import Any

from retarget_bench.api import Case, Context
from retarget_bench.errors import NotSupported
from retarget_bench.evaluation.prediction import question_files as files
from retarget_bench.evaluation.prediction.limits import Beyond

Question = tuple[Case, Context]
MOTIONS = ("reference", "second_reference", "source_motion")
CLIPS = ("other_clips", "target_motions")
"""Parts of a context that are motions, and those that are several clips."""


class Questions:
    """Of one worker, in its folder, under names that cannot be guessed.

    kept: names of files that stay, as the next questions may be of the same bodies.
    """

    def __init__(self, folder: Path) -> None:
        self.kept = set[str]()
        self._folder, self._token = folder, token_hex(8)
        self._questions: Sequence[Question] = ()
        self._written: list[Path] = []

    def write(self, questions: Sequence[Question]) -> list[dict[str, Any]]:
        """Write the files of every question; their paths, and that of its answer. Raises OSError."""
        self._questions = questions
        return [self._question(*each) for each in questions]

    def remove(self) -> None:
        """Remove the files of questions that are answered, and their answers."""
        for path in self._written:
            with suppress(OSError):
                path.unlink()
        self._written.clear()

    def handed_over(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The file of a part of a question that a method looks at. Raises Beyond where there is none."""
        try:
            kind, (case, context) = request["give"], self._questions[int(request.get("question", 0))]
            if kind == "training":
                training = context.training
                index = training and files.write_training(self._folder, self._token, training)
                return {"index": index and str(index)}
            if kind == "mesh":
                moved = (case.source, context.source_motion, context.reference, context.second_reference)
                bodies = (case.target, *(each.character for each in moved if each is not None))
                mesh = {str(self._body(body)): body for body in bodies}[request["character"]].mesh
                assert mesh is not None
                return {"mesh": str(self._stays(files.write_mesh(self._folder, self._token, mesh)))}
            if kind not in CLIPS:
                raise KeyError(kind)
            return self._place(getattr(context, kind)[int(request["index"])])
        except NotSupported as error:
            return {"why": str(error)}
        except (KeyError, IndexError, TypeError, ValueError, AssertionError, OverflowError) as error:
            raise Beyond(f"the method's process asks for what there is not ({error})") from error

    def _question(self, case: Case, context: Context) -> dict[str, Any]:
        self._written.append(self._folder / f"{token_hex(8)}.npz")
        return {
            "answer": str(self._written[-1]),
            "source": str(self._motion(case.source)),
            "source_character": str(self._body(case.source.character)),
            "target_character": str(self._body(case.target)),
            "context": self._context(context),
        }

    def _context(self, context: Context) -> dict[str, Any]:
        """The context of a question as JSON; clips and training motion are handed over when asked for."""
        facts: dict[str, Any] = {
            "seed": context.seed,
            "device": context.device,
            "precision": context.precision,
        }
        if context.training is not None:
            facts["training"] = True
        if context.ground is not None:
            facts["ground"] = files.ground_facts(context.ground)
        for kind in MOTIONS:
            if (motion := getattr(context, kind)) is not None:
                facts[kind] = self._place(motion)
        for kind in CLIPS:
            if (clips := getattr(context, kind)) is not None:
                facts[kind] = len(clips)
        return facts

    def _place(self, motion: Any) -> dict[str, str]:
        return {"motion": str(self._motion(motion)), "character": str(self._body(motion.character))}

    def _motion(self, motion: Any) -> Path:
        self._written.append(files.write_motion(self._folder, token_hex(8), motion))
        return self._written[-1]

    def _body(self, body: Any) -> Path:
        return self._stays(files.write_character(self._folder, self._token, body))

    def _stays(self, path: Path) -> Path:
        self.kept.add(path.name)
        return path
