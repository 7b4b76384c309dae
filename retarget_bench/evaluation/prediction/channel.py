"""Lines of JSON between two processes, read with a limit in time and in length."""

import json
import os
import select
import time
from contextlib import suppress
from typing import Any

from retarget_bench.errors import BenchError

LONGEST = 8 * 2**20
"""Bytes of a line: of an answer to a batch a few thousand are usual."""


class Closed(BenchError):
    """The other process is gone."""


class Nonsense(Closed):
    """The other process wrote something that is no line of JSON."""


class Channel:
    """Two file descriptors, one to read lines from and one to write them to."""

    def __init__(self, reading: int, writing: int) -> None:
        self.reading, self.writing = reading, writing
        self._waiting = bytearray()

    def send(self, message: dict[str, Any]) -> None:
        """Raises Closed."""
        data = json.dumps(message).encode() + b"\n"
        try:
            while data:
                data = data[os.write(self.writing, data) :]
        except OSError as error:
            raise Closed(f"it cannot be written to ({error.strerror})") from error

    def receive(self, seconds: float | None = None) -> dict[str, Any] | None:
        """The next line; None where none has come within so many seconds. Raises Closed, Nonsense."""
        until = None if seconds is None else time.monotonic() + seconds
        end = self._waiting.find(b"\n")
        while end < 0:
            if until is not None:
                left = max(0.0, until - time.monotonic())
                if not select.select([self.reading], [], [], left)[0]:
                    return None
            piece = self._read()
            if b"\n" in piece:
                end = len(self._waiting) + piece.index(b"\n")
            self._waiting += piece
            if end < 0 and len(self._waiting) > LONGEST:
                raise Nonsense("it says lines of many megabytes")
        line = bytes(self._waiting[:end])
        del self._waiting[: end + 1]
        try:
            message = json.loads(line)
        except (ValueError, RecursionError):
            message = None
        if not isinstance(message, dict):
            raise Nonsense(f"it says {line[:80]!r} where an answer is due")
        return message

    def _read(self) -> bytes:
        try:
            piece = os.read(self.reading, 2**16)
        except OSError as error:
            raise Closed(f"it cannot be read from ({error.strerror})") from error
        if not piece:
            raise Closed("it has ended")
        return piece

    def close(self) -> None:
        for each in {self.reading, self.writing}:
            with suppress(OSError):
                os.close(each)
