"""How long a folder of Mixamo motions takes to list and to load, from an empty cache and from a full one.

    python tests/benchmarks/mixamo_loading.py PATH/TO/mixamo [parameter=value ...]

in an environment in which retarget-bench is installed. One process. Cold: nothing is cached. Warm: a new
process that finds the parsed motions of the first.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time


def measure(root: str, parameters: dict[str, str]) -> None:
    """Print what one process needs for everything."""
    from retarget_bench.api import SPLITS
    from retarget_bench.datasets.mixamo import Mixamo
    from retarget_bench.plugins.spec import read_value

    begin = time.perf_counter()
    dataset = Mixamo(root, **{name: read_value(text) for name, text in parameters.items()})
    infos = [info for split in SPLITS for info in dataset.cases("retarget", split)]
    content = dataset.content
    listed = time.perf_counter()
    frames = sum(dataset.load(info).source.frames for info in infos)
    loaded = time.perf_counter()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"list {len(infos)} cases: {listed - begin:.2f} s ({content.split()[0][:16]})")
    print(
        f"load them: {loaded - listed:.2f} s, {1000 * (loaded - listed) / len(infos):.2f} ms per case, "
        f"{frames} frames; peak memory {peak:.0f} MB"
    )


def main() -> None:
    if os.environ.get("MEASURE"):
        measure(sys.argv[1], dict(each.split("=", 1) for each in sys.argv[2:]))
        return
    with tempfile.TemporaryDirectory() as cache:
        for name in ("cold", "warm"):
            print(name, flush=True)
            environment = os.environ | {"RETARGET_BENCH_CACHE": cache, "MEASURE": "1"}
            subprocess.run([sys.executable, *sys.argv], env=environment, check=True)


if __name__ == "__main__":
    main()
