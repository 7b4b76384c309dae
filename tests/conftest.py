"""What all tests share: where real data lies, a cache that is not the user's, one thread."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

# One test a core: threads of torch beside that would spend the time waiting for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# What a shell starts in the background ignores Ctrl-C, and so would the commands that tests interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

from tests.viewing.browser import browser, open_page, tabs  # noqa: F401  (fixtures)


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real motion files: ``RETARGET_BENCH_DATA``, else ``shared/data`` in a folder above."""
    if chosen := os.environ.get("RETARGET_BENCH_DATA"):
        if not Path(chosen).is_dir():
            pytest.fail(f"RETARGET_BENCH_DATA={chosen} is not a folder")
        return Path(chosen)
    for folder in Path(__file__).resolve().parents:
        if (folder / "shared" / "data").is_dir():
            return folder / "shared" / "data"
    pytest.skip("no real motion data: set RETARGET_BENCH_DATA to its folder")


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Parsed and generated data goes to a temporary folder of all workers, also in child processes."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    patch = pytest.MonkeyPatch()
    patch.setenv("RETARGET_BENCH_CACHE", str(folder / "cache"))
    yield
    patch.undo()
