"""retarget-bench: run, score and compare motion-retargeting methods fairly."""

from pathlib import Path

__version__ = "0.1.0"

# In a checkout methods/, metrics/ and datasets/ stand beside this package; in a wheel they lie in it.
if not (Path(__file__).parent / "methods").is_dir():
    __path__.append(str(Path(__file__).parent.parent))
