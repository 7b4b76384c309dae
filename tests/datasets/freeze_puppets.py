"""Writes anew what is frozen of the puppets: who cannot do what, and the stored sample.

    PYTHONPATH=. python tests/datasets/freeze_puppets.py [--processes 2]

To be run after a deliberate change of the generator, together with a new ``corpus.VERSION``. Takes a few
minutes. Prints what changed.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import tempfile

from test_puppets import SAMPLE, sample

from retarget_bench.datasets.puppets import exclusions
from retarget_bench.datasets.puppets import plugin as Puppets


def drawn() -> dict[str, list[list[float]]]:
    return sample(Puppets())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--processes", type=int, default=2)
    before = exclusions.FILE.read_text(encoding="utf-8")
    exclusions.write(parser.parse_args().processes)
    after = exclusions.FILE.read_text(encoding="utf-8")
    print(f"exclusions: {after.count('{') - 1} clips, {'as before' if after == before else 'changed'}")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["RETARGET_BENCH_CACHE"] = folder
        # lists depend on the exclusions and are remembered: in a process of its own
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            found = pool.apply(drawn)
    text = json.dumps(found) + "\n"
    same = SAMPLE.read_text(encoding="utf-8") == text
    SAMPLE.write_text(text, encoding="utf-8")
    print(f"sample: {len(found)} motions, {'as before' if same else 'changed'}")


if __name__ == "__main__":
    main()
