"""Files outside a method's code that its answers depend on: found, hashed and verified for the method.

A card names them, ``assets={"network.npz": Asset("the weights")}``. The name is that of a file or folder
beside the method's module, or of a parameter whose value is a path; a parameter's default lies beside the
module, any other value where the user says. The method asks for them with ``asset_path``.
"""

import hashlib
import inspect
from functools import lru_cache
from pathlib import Path
from typing import Any

from retarget_bench.api.completing import original
from retarget_bench.api.methods import Method
from retarget_bench.errors import BenchError
from retarget_bench.files import digest
from retarget_bench.plugins.post_processors import Composed


def asset_path(method: Method, name: str) -> Path:
    """Where an asset lies, in full. Raises BenchError where it is not there or not what the card says."""
    asset = method.card.assets[name]
    path, parameter = _place(method, name)
    needing = method.card.name.partition("+")[0]
    if not path.exists():
        cure = f"give {parameter}=PATH" if parameter else "put it there"
        raise BenchError(f"{needing} needs {asset.what}: {path} is not there; {cure}")
    if asset.sha256 and (held := asset_hash(path)) != asset.sha256:
        raise BenchError(
            f"{needing} needs {asset.what} with sha256 {asset.sha256[:12]}...; {path} has {held[:12]}..."
        )
    return path


def asset_hashes(method: Any) -> dict[str, str]:
    """Asset -> sha256 of what it holds, which keys of results depend on. Raises BenchError."""
    return {name: asset_hash(asset_path(method, name)) for name in sorted(method.card.assets)}


def _place(method: Any, name: str) -> tuple[Path, str]:
    """Where an asset has to lie, and the parameter that holds this path, "" where none does."""
    method = original(method.method if isinstance(method, Composed) else method)
    home = Path(inspect.getfile(type(method))).parent
    parameters = inspect.signature(type(method)).parameters
    if name not in parameters:
        return home / name, ""
    if not hasattr(method, name):
        raise BenchError(f"{method.card.name}: keep the parameter {name} in self.{name}, where it is found")
    value = str(getattr(method, name))
    if value == parameters[name].default:
        return home / value, name
    return Path(value).expanduser().absolute(), name


def asset_hash(path: Path) -> str:
    """sha256 of a file, or of all files in a folder with their names. Raises BenchError."""
    try:
        if path.is_file():
            return _file_hash(path, *_stamp(path))
        files = sorted(file for file in path.rglob("*") if file.is_file())
        hashes = [(file.relative_to(path).as_posix(), _file_hash(file, *_stamp(file))) for file in files]
    except OSError as error:
        raise BenchError(f"{path} cannot be read ({error.strerror or error})") from error
    return digest(repr(hashes), 64)


def _stamp(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=1024)
def _file_hash(path: Path, _changed: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
