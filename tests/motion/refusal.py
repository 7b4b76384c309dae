"""The sentence about a file that cannot be read."""

from __future__ import annotations

from pathlib import Path

import pytest

from retarget_bench.errors import FileError
from retarget_bench.motion import files


def told(path: Path) -> str:
    """The sentence, which is one line, without the name of the file in front of it."""
    with pytest.raises(FileError) as error:
        files.read(path).skin()
    message = str(error.value)
    assert message.startswith(str(path.parent))
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")
