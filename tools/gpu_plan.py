"""The trainings of ``gpu_run.sh``: for each METHOD a line of its folder, itself, and options of
``bench train``.

    python -m tools.gpu_plan METHOD...

Initial weights are those of an earlier run (``earlier/FOLDER``), else shipped ones, else none. The data are
those of ``train_release``, or what the variable DATA names.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import joint_datasets
from tools import train_release as release

EARLIER = Path("earlier")


def line(text: str) -> str:
    """The line of a method. Raises BenchError for one that ``train_release`` does not train."""
    trainings = {each.method: each for each in release.TRAININGS}
    if text not in trainings:
        raise BenchError(f"{text}: trained are {', '.join(trainings)}")
    spec = Spec.parse(text)
    built: Any = bound.method(spec).built
    data = Spec.parse(os.environ.get("DATA", "")) if "DATA" in os.environ else None
    parts = joint_datasets.split_spec(data or release.data_of(trainings[text], tiny=False))
    words = [spec.slug, text, *(word for each in parts for word in ("-d", str(each)))]
    if (EARLIER / spec.slug).is_dir():
        words += ["--init", str(EARLIER / spec.slug)]
    elif not built.untrained:
        words += ["--init", built.config.weights]
    return " ".join(words)


def main(methods: Sequence[str]) -> None:
    try:
        print("\n".join(map(line, methods)))
    except BenchError as error:
        sys.exit(f"gpu_plan: {error}")


if __name__ == "__main__":
    main(sys.argv[1:])
