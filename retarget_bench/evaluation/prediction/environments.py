"""Other Python environments: the commands that start workers there, and the facts that these report."""

import hashlib
import os
import shlex
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.prediction import launch
from retarget_bench.evaluation.prediction.channel import Closed
from retarget_bench.evaluation.prediction.limits import STARTING
from retarget_bench.files import digest

BOOT = Path(__file__).with_name("other_python.py")
NOT_INHERITED = ("PYTHONPATH", "PYTHONHOME", "__PYVENV_LAUNCHER__")
"""Variables that would bring packages of this environment into the other one."""
FACTS = ("name", "lock", "python", "platform", "packages")


class NoWorker(BenchError):
    """A command that starts no worker."""


def in_full(environment: str) -> str:
    """An environment with the paths of its files in full, for processes that work in other folders."""
    expanded = str(Path(environment).expanduser()) if environment.startswith("~") else environment
    try:
        words = [expanded] if Path(expanded).is_file() else shlex.split(expanded)
    except ValueError as error:
        raise BenchError(f"{environment!r} is no command ({error})") from None
    return shlex.join(str(Path(word).absolute()) if Path(word).is_file() else word for word in words)


def start(
    environment: str, log: Path, mark: str, prefix: Sequence[str] = ()
) -> tuple[launch.Spawned, Mapping[str, Any]]:
    """Start a worker that waits for its method; the worker, and the facts of its environment.

    environment: of ``in_full``. A Python is started with this package; a command that names a ``.py`` file
    is a worker of its own (``numpy_worker.py``). log: takes what it prints. mark: of ``launch.new_mark``.
    prefix: words before its command. Raises NoWorker.
    """
    words = [*prefix, *shlex.split(environment)]
    command = words if own_worker(environment) else [*words, str(BOOT)]
    inherited = {name: value for name, value in os.environ.items() if name not in NOT_INHERITED}
    try:
        started = launch.Spawned(command, inherited, str(log), mark)
    except OSError as error:
        raise NoWorker(f"no worker can be started by {words[0]} ({error.strerror})") from error
    try:
        message = started.channel.receive(STARTING)
        why = f"nothing was said within {STARTING:g} s" if message is None else ""
        facts = message and message.get("environment")
    except Closed as error:
        facts, why = None, str(error)
    except BaseException:  # Ctrl-C
        launch.end(started)
        raise
    if isinstance(facts, dict) and _sound(facts):
        return started, {name: facts[name] for name in FACTS}
    launch.end(started)
    printed = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    last = printed[-1].strip() if printed else why or "it does not tell its environment"
    raise NoWorker(f"no worker can be started by {environment!r}: {last}")


def _sound(facts: Mapping[str, Any]) -> bool:
    """True for facts of an environment that are complete and of the right types."""
    texts = [facts.get(name) for name in FACTS if name != "packages"]
    packages = facts.get("packages")
    sound = isinstance(packages, dict) and all(isinstance(each, str) for each in packages.values())
    return sound and all(isinstance(each, str) and each.strip() for each in texts)


@cache
def facts(environment: str) -> Mapping[str, Any]:
    """Name, lock hash, interpreter, platform and packages of an environment. Raises NoWorker."""
    with TemporaryDirectory(prefix="retarget-bench-", ignore_cleanup_errors=True) as folder:
        started, facts = start(environment, Path(folder) / "printed.txt", launch.new_mark())
        launch.end(started)
    return facts


def label(environment: str) -> str:
    """The name of an environment in results, the same wherever it lies: ``python3.10-3f2a91c0``."""
    report = facts(environment)
    version = ".".join(str(report["python"]).split()[-1].split(".")[:2])
    return f"python{version}-{report['lock'][:8]}"


def key_facts(environment: str) -> dict[str, str]:
    """Facts that predictions depend on: the lock, and the text of a worker's own files."""
    own = [word for word in shlex.split(environment) if word.endswith(".py")]
    return {"lock": str(facts(environment)["lock"]), "files": files_hash(own)}


def files_hash(words: Sequence[str]) -> str:
    """Sixteen hex digits of the contents of those words of a command that are files; "" where none is."""
    files = [Path(word) for word in words if Path(word).is_file()]
    return digest(
        "\n".join(hashlib.sha256(path.read_bytes()).hexdigest() for path in files), 16 * bool(files)
    )


def own_worker(environment: str) -> bool:
    """True for a command that starts a worker of its own."""
    return any(word.endswith(".py") for word in shlex.split(environment))
