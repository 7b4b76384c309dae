"""retarget-bench: run, score and compare motion-retargeting methods fairly.

From Python (docs/python.md)::

    import retarget_bench as rb

    results = rb.run(["copy_rotations", "ik"])
    results.table()
    rb.retarget("walk.bvh", "me.bvh", "ik").save("me_walking.bvh")

Importing this package imports nothing else; what is used is imported then.
"""

import importlib
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from retarget_bench.errors import BenchError as BenchError
    from retarget_bench.python.listing import datasets as datasets
    from retarget_bench.python.listing import methods as methods
    from retarget_bench.python.listing import metrics as metrics
    from retarget_bench.python.motions import Character as Character
    from retarget_bench.python.motions import Motion as Motion
    from retarget_bench.python.motions import load_character as load_character
    from retarget_bench.python.motions import load_motion as load_motion
    from retarget_bench.python.motions import retarget as retarget
    from retarget_bench.python.motions import verdict as verdict
    from retarget_bench.python.results import Results as Results
    from retarget_bench.python.results import load_results as load_results
    from retarget_bench.python.running import run as run
    from retarget_bench.python.scans import retarget_scans as retarget_scans
    from retarget_bench.python.views import ListFrame

__version__ = "0.1.0"

_OFFERED = {
    "BenchError": "errors",
    "Character": "python.motions",
    "Motion": "python.motions",
    "Results": "python.results",
    "load_character": "python.motions",
    "load_motion": "python.motions",
    "load_results": "python.results",
    "retarget": "python.motions",
    "retarget_scans": "python.scans",
    "run": "python.running",
    "verdict": "python.motions",
}
"""Name -> the module of this package that has it."""
_ROOMS = ("methods", "metrics", "datasets")
__all__ = ["__version__", *_OFFERED, *_ROOMS]

# In a checkout methods/, metrics/ and datasets/ stand beside this package; in a wheel they lie in it.
if not (Path(__file__).parent / "methods").is_dir():
    __path__.append(str(Path(__file__).parent.parent))


def __getattr__(name: str) -> Any:
    if name not in _OFFERED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_OFFERED[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


class _Room(ModuleType):
    """A folder of plug-ins: ``rb.methods`` holds their modules, ``rb.methods()`` lists them."""

    def __call__(self) -> "ListFrame":
        listing = importlib.import_module(f"{__package__}.python.listing")
        found: ListFrame = getattr(listing, self.__name__.rpartition(".")[2])()
        return found


for _room in _ROOMS:  # namespace packages without code: nothing is run
    importlib.import_module(f"{__name__}.{_room}").__class__ = _Room
