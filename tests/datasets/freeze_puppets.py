"""Writes anew what is frozen of the puppets: who cannot do what, the corpus of size tiny, and the release.

    PYTHONPATH=. python tests/datasets/freeze_puppets.py [--processes 2] [--release-only]

To be run after a deliberate change of the generator, together with a new ``contract.VERSION``; takes a few
minutes. What the puppets promise is measured by ``pytest -m slow tests/datasets``. After a new version of a
metric alone, ``--release-only``. Prints what changed. What was published under a name stays under it: a
change of the release asks for a new ``dataset.RELEASE``.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import tempfile
from pathlib import Path

from test_puppets_release import FILE, release

from retarget_bench.datasets.puppets import archives
from retarget_bench.datasets.puppets.frozen import FOLDER
from retarget_bench.datasets.puppets.generator.corpus import freezing
from retarget_bench.datasets.puppets.generator.corpus.clips import EXCLUSIONS, write_exclusions


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--release-only", action="store_true")
    options = parser.parse_args()
    if not options.release_only:
        before = EXCLUSIONS.read_text(encoding="utf-8")
        write_exclusions(options.processes)
        after = EXCLUSIONS.read_text(encoding="utf-8")
        print(f"exclusions: {after.count('{') - 1} clips, {'as before' if after == before else 'changed'}")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["RETARGET_BENCH_CACHE"] = folder
        # lists depend on the exclusions and are remembered: in a process of its own
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            if not options.release_only:
                sums = FOLDER / archives.SUMS
                before = sums.read_text(encoding="utf-8")
                pool.apply(freezing.write)
                same = sums.read_text(encoding="utf-8") == before
                print(f"tiny: {'as before' if same else 'changed'}")
            facts = pool.apply(release)
    print(f"release: {facts['release']}, {_written(FILE, json.dumps(facts, indent=1))}")


def _written(path: Path, text: str) -> str:
    """Write a file; whether it is as it was."""
    same = path.exists() and path.read_text(encoding="utf-8") == text + "\n"
    path.write_text(text + "\n", encoding="utf-8")
    return "as before" if same else "changed"


if __name__ == "__main__":
    main()
