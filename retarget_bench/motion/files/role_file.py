"""Files that say what joints are, over what is found (``--roles``)."""

from pathlib import Path

from retarget_bench.files import read_toml
from retarget_bench.motion.roles import load_overrides


def read(path: Path) -> dict[str, str | None]:
    """Joint name -> role or None, of a role file. Raises FileError.

    What ``motion/roles.py`` does counts as code of every method, so hostile files are refused here.
    """
    read_toml(path)
    return load_overrides(path)
