"""A method whose process does not keep to the ways of answering."""

import os
import shutil
import sys
from pathlib import Path

import numpy as np

from retarget_bench.api import MethodCard
from retarget_bench.evaluation.prediction.numpy_worker import digest


class Impostor:
    def __init__(self, does: str, note: str = "") -> None:
        self.does, self.note = does, note
        self.card = MethodCard(
            name="impostor", summary="does not keep to it", version="1", needs=("other_clips",)
        )
        if does == "unbuilt":
            raise ValueError("no such thing")
        if does == "leaves_at_once":
            os._exit(4)

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        answer = getattr(self, f"_{self.does}", lambda *_: None)(target, context)
        return answer or target.motion(source.rotations, source.root, source.fps)

    def _desk(self):
        frame = sys._getframe()
        while frame := frame.f_back:
            if "questions" in frame.f_locals and "self" in frame.f_locals:
                return frame.f_locals["self"], frame.f_locals["questions"][0]
        raise LookupError

    def _instead(self, make):
        """Answer with what ``make`` puts in the place of the file."""
        endpoint, question = self._desk()
        make(Path(question["answer"]))
        reply = {"status": "ok", "message": ""}
        if Path(question["answer"]).is_file():
            reply["digest"] = digest(Path(question["answer"]).read_bytes())
        endpoint.channel.send({"answers": [reply]})
        os._exit(0)

    def _link(self, target, context):
        self._instead(lambda path: path.symlink_to(self.note))

    def _pipe(self, target, context):
        self._instead(lambda path: os.mkfifo(path))

    def _folder(self, target, context):
        self._instead(lambda path: path.mkdir())

    def _nothing(self, target, context):
        self._instead(lambda path: None)

    def _pickle(self, target, context):
        self._instead(lambda path: np.savez(path, rotations=np.array([{"a": 1}], dtype=object)))

    def _bomb(self, target, context):
        self._instead(lambda path: np.savez_compressed(path, rotations=np.zeros(2**24)))

    def _babble(self, target, context):
        os.write(self._desk()[0].channel.writing, b"\x00\xff not a line of ours\n")

    def _array(self, target, context):
        os.write(self._desk()[0].channel.writing, b"[1, 2]\n")

    def _short(self, target, context):
        self._desk()[0].channel.send({"answers": []})

    def _wishes(self, target, context):
        self._desk()[0].channel.send({"give": "reference", "question": 0, "index": 0})

    def _far(self, target, context):
        return context.other_clips[10**6]

    def _exit(self, target, context):
        raise SystemExit("out of here")

    def _unreadable(self, target, context):
        class Odd(Exception):
            def __str__(self):
                raise ValueError

        raise Odd

    def _surrogate(self, target, context):
        raise ValueError("half a character: \ud800")

    def _flood(self, target, context):
        while True:
            os.write(1, b"x" * 2**20)

    def _words(self, target, context):
        print("step 3")
        while True:
            pass

    def _no_folder(self, target, context):
        shutil.rmtree("..", ignore_errors=True)
        raise RuntimeError("gone")

    def _daemon(self, target, context):
        """A process that nobody knows: of no parent, no group, and no environment."""
        if not os.fork():
            if not os.fork():
                os.setsid()
                os.execve("/bin/sleep", ["sleep", self.note], {})
            os._exit(0)

    def _once(self, target, context):
        """Die at the first attempt only."""
        if not Path(self.note).exists():
            Path(self.note).touch()
            os._exit(9)

    def _slow_once(self, target, context):
        """Be too slow the first two times."""
        with Path(self.note).open("a") as note:
            note.write("x")
        while len(Path(self.note).read_text()) < 3:
            pass


plugin = Impostor
