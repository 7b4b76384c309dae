"""What the command line costs before it does anything, beside ``import click``, in the same run.

Run it with ``python tests/benchmarks/startup.py``. Every command is started in turn, many times; the
quickest start of each counts, since everything else is other work of the machine.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROUNDS = 40
PEER = "import click"
COMMANDS = {
    "python": ["-c", ""],
    PEER: ["-c", "import click"],
    "import retarget_bench": ["-c", "import retarget_bench"],
    "bench --help": ["-m", "retarget_bench", "--help"],
    "bench list": ["-m", "retarget_bench", "list"],
    "bench run --help": ["-m", "retarget_bench", "run", "--help"],
    "import numpy": ["-c", "import numpy"],
}


def seconds(arguments: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def main() -> None:
    best = dict.fromkeys(COMMANDS, float("inf"))
    for _ in range(ROUNDS):
        for name, arguments in COMMANDS.items():
            best[name] = min(best[name], seconds(arguments))
    print(f"{'':<24}{'ms':>8}{'x ' + PEER:>16}")
    for name, taken in best.items():
        print(f"{name:<24}{1000 * taken:>8.1f}{taken / best[PEER]:>16.2f}")


if __name__ == "__main__":
    main()
