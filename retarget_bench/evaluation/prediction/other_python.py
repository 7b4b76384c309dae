"""The first steps of a worker in another Python: that environment, and this very package with its method.

Run as a file by that Python, which may be too old or lack what is needed: it then ends with a sentence.
"""

import importlib.util
import json
import os
import sys
from pathlib import Path

HERE = Path(__file__).absolute().parent
OLDEST = (3, 11)


def main() -> None:
    """Say which environment this is, then begin as asked by the first line."""
    if sys.version_info < OLDEST:
        this, oldest = (".".join(map(str, version[:2])) for version in (sys.version_info, OLDEST))
        sys.exit(
            f"this is Python {this} and the package needs {oldest}; numpy_worker.py is for older ones "
            "(docs/plugins.md)"
        )
    sys.path[:] = [each for each in sys.path if Path(each).absolute() != HERE]  # its files are no modules
    reading, writing = os.dup(0), os.dup(1)
    os.dup2(2, 1)
    _import_package(HERE.parents[1])
    from retarget_bench.evaluation.prediction import answering, numpy_worker

    os.write(writing, json.dumps({"environment": numpy_worker.environment()}).encode() + b"\n")
    line = os.read(reading, 2**16)
    while line and not line.endswith(b"\n"):
        line += os.read(reading, 2**16)
    if line:
        answering.begin(json.loads(line)["start"], reading, writing)


def _import_package(folder: Path) -> None:
    """Import the package from its folder: neither another version of it, nor what lies beside it."""
    place = folder / "__init__.py"
    spec = importlib.util.spec_from_file_location(
        folder.name, place, submodule_search_locations=[str(folder)]
    )
    assert spec is not None
    assert spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    sys.modules[folder.name] = package
    spec.loader.exec_module(package)


if __name__ == "__main__":
    main()
