"""A prediction worker that needs numpy alone and Python 3.7: copy it beside code that runs nowhere else.

    python numpy_worker.py my_code.py

``my_code.py`` has a function ``retarget(source, target, context)``; docs/plugins.md tells what it is
given and returns. Questions are lines on the standard input, answers are lines on the standard output.
"""

from __future__ import annotations  # for Python 3.7 and 3.8

import faulthandler
import hashlib
import importlib.util
import io
import json
import os
import platform
import select
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

SHOWN = ("numpy", "scipy", "torch", "tensorflow", "jax")
"""Packages whose versions results name; all of them are in the lock."""


# --------------------------------------------------------------------------------------------- environment
def environment() -> dict[str, Any]:
    """The environment that this process runs in: its name, what it holds, and a hash of that (``lock``)."""
    packages = dict(reversed(list(_distributions())))  # of several with one name the first is imported
    python = f"{platform.python_implementation()} {platform.python_version()}"
    machine = f"{sys.platform}-{platform.machine()}"
    lines = [python, machine, *sorted(f"{name}=={version}" for name, version in packages.items())]
    prefix = Path(sys.prefix)
    folder = prefix.parent if prefix.name in (".venv", "venv", "env") else prefix
    return {
        "name": os.environ.get("CONDA_DEFAULT_ENV") or folder.name,
        "lock": hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16],
        "python": python,
        "platform": machine,
        "packages": {name: packages[name] for name in SHOWN if name in packages},
    }


def _distributions() -> Iterator[tuple[str, str]]:
    """(name, version) of everything installed, in the order in which it is found."""
    try:
        from importlib import metadata
    except ImportError:  # Python 3.7
        for each in importlib.import_module("pkg_resources").working_set:
            yield each.key.replace("_", "-"), each.version
        return
    for distribution in metadata.distributions():
        if distribution.metadata["Name"]:
            yield distribution.metadata["Name"].lower().replace("_", "-"), distribution.version


# --------------------------------------------------------------------------------------------------- files
def checked(path: str) -> bytes:
    """The contents of a file of a question, whose name ends in their digest."""
    data = Path(path).read_bytes()
    if digest(data) != Path(path).stem.rpartition("-")[2]:
        raise OSError(f"{path} was changed since it was written")
    return data


def digest(data: bytes) -> str:
    """Hex digits that stand for the contents of a file."""
    return hashlib.sha256(data).hexdigest()[:32]


def body(path: str) -> dict[str, Any]:
    """A body, with its numbers as arrays."""
    facts = json.loads(checked(path))
    return {**facts, **{name: np.array(facts[name]) for name in ("parents", "offsets", "reference_pose")}}


def motion(path: str, character: str) -> dict[str, Any]:
    """A motion: ``rotations`` and ``root``, or ``positions``, or ``points`` of all frames in turn and their
    ``counts``; ``fps`` and its ``body``."""
    with np.load(io.BytesIO(checked(path))) as file:
        arrays = {name: file[name] for name in file.files}
    return {**arrays, "fps": float(arrays["fps"]), "body": body(character)}


def write(path: str, answer: dict[str, Any]) -> str:
    """Write the answer's ``rotations`` and ``root``, its ``positions`` or ``vertices``, in single
    precision; the digest of the file."""
    alone = [name for name in ("positions", "vertices") if name in answer]
    names = alone or ("rotations", "root")
    arrays: dict[str, Any] = {name: np.asarray(answer[name], dtype=np.float32) for name in names}
    np.savez(path, **arrays)
    return digest(Path(path).read_bytes())


# ---------------------------------------------------------------------------------------------- the worker
def answer(question: dict[str, Any], retarget: Callable, parameters: dict[str, Any]) -> dict[str, Any]:
    """How one question went: ``ok`` with the answer written, ``unsupported``, or ``failed``."""
    process = os.getpid()
    try:
        context = {**question["context"], "parameters": parameters}
        for name in ("reference", "second_reference", "source_motion"):
            if context.get(name):
                context[name] = motion(context[name]["motion"], context[name]["character"])
        source = motion(question["source"], question["source_character"])
        result = retarget(source, body(question["target_character"]), context)
        if os.getpid() != process:  # the method forked, and its child came back
            os._exit(0)
        return {"status": "ok", "message": "", "digest": write(question["answer"], result)}
    except NotImplementedError as error:
        return {"status": "unsupported", "message": str(error)}
    except Exception as error:
        traceback.print_exc()
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(where.filename).name}:{where.lineno}"
        return {"status": "failed", "message": f"{type(error).__name__}: {error} ({place})"}


def end_with(reading: int) -> None:
    """From now on, this process ends when whoever asks it does, whatever it is at, with what it started."""

    def watch() -> None:
        poll = select.poll()
        poll.register(reading, 0)  # hang-ups are told in any case
        poll.poll()
        if os.getpgrp() == os.getpid():
            os.killpg(os.getpid(), signal.SIGKILL)
        os._exit(1)

    if hasattr(select, "poll"):
        threading.Thread(target=watch, daemon=True).start()


def code(path: Path) -> Any:
    """The module in a file, imported in its own folder, where it finds its files."""
    os.chdir(str(path.parent))
    sys.path.insert(0, str(path.parent))
    spec = importlib.util.spec_from_file_location("retarget_code", str(path))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def main() -> None:
    """Answer until the standard input ends."""
    questions, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", 0)
    os.dup2(2, 1)  # what the code prints goes to the log
    end_with(questions.fileno())
    faulthandler.enable()

    def say(message: dict[str, Any]) -> None:
        answers.write(json.dumps(message).encode() + b"\n")

    retarget = code(Path(sys.argv[1]).absolute()).retarget
    say({"environment": environment()})
    parameters: dict[str, Any] = {}
    for line in iter(questions.readline, b""):
        request = json.loads(line)
        if "start" in request:
            parameters = request["start"]["parameters"]
            say({"ready": True})
        else:
            say({"answers": [answer(question, retarget, parameters) for question in request["ask"]]})


if __name__ == "__main__":
    main()
