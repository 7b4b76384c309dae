"""Time and peak memory of ``bench run`` on a folder of Mixamo motions, cold and with parsed motions cached.

    python tests/benchmarks/mixamo_run.py PATH/TO/mixamo

Cold: an empty cache folder and no results. Warm: the cache of the cold run, no results. Memory is the sum
over all processes of the run of what each holds for itself and shares (resident set), the largest of
samples taken every 50 ms; memory shared between processes counts once per process.
"""

import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

METHODS = ("copy_rotations", "bone_directions", "ik", "rest_pose")


def resident(session: int) -> int:
    """Bytes of all processes of a session."""
    total = 0
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            if os.getsid(int(folder.name)) == session:
                total += int((folder / "statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        except (OSError, ValueError):
            continue
    return total


def timed(root: str, cache: str, out: str) -> tuple[float, int]:
    """Seconds and peak bytes of one run."""
    line = [
        sys.executable,
        "-m",
        "retarget_bench",
        "run",
        *METHODS,
        "-d",
        "mixamo",
        "--root",
        root,
        "--out",
        out,
    ]
    environment = os.environ | {"RETARGET_BENCH_CACHE": cache}
    start, peak = time.perf_counter(), 0
    process = subprocess.Popen(line, env=environment, start_new_session=True, stdout=subprocess.DEVNULL)
    while process.poll() is None:
        peak = max(peak, resident(process.pid))
        time.sleep(0.05)
    if process.returncode:
        raise SystemExit(f"bench run failed with exit code {process.returncode}")
    return time.perf_counter() - start, peak


def main() -> None:
    if len(sys.argv) != 2:
        raise SystemExit("give the folder of Mixamo motions: python tests/benchmarks/mixamo_run.py DIR")
    print(f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}")
    with tempfile.TemporaryDirectory() as folder:
        for name in ("cold", "warm"):
            seconds, peak = timed(sys.argv[1], f"{folder}/cache", f"{folder}/{name}")
            print(f"{name}: {seconds:6.1f} s, peak memory {peak / 2**30:.2f} GiB")


if __name__ == "__main__":
    main()
