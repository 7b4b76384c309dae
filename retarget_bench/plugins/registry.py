"""Plug-ins by name: found without being imported, imported when they are used.

A plug-in comes from one of three places: a file or folder in ``methods/``, ``metrics/``,
``datasets/`` and ``methods/posts/``, whose name is the plug-in's name; an entry point of an installed
distribution, in the groups ``retarget_bench.methods``, ``.metrics``, ``.datasets`` and ``.posts``; a file
that is named where a plug-in is (``my_method.py``). Whatever goes wrong inside a plug-in becomes a
BenchError that names it and its origin.
"""

from __future__ import annotations

import ast
import difflib
import importlib
import importlib.util
import re
import sys
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any, Literal

import retarget_bench
from retarget_bench import files as files_
from retarget_bench.errors import BenchError
from retarget_bench.plugins import parameters
from retarget_bench.plugins.code_hash import own_files
from retarget_bench.plugins.spec import NAME, Spec, folded

Kind = Literal["methods", "metrics", "datasets", "posts"]
KINDS: tuple[Kind, ...] = ("methods", "metrics", "datasets", "posts")
SINGULAR = {"methods": "method", "metrics": "metric", "datasets": "data set", "posts": "post-processor"}
ROOMS: dict[Kind, str] = {kind: kind for kind in KINDS} | {"posts": "methods/posts"}
"""The folders of the built-in plug-ins."""
BUILT_IN = "built-in"
_FILE_MODULE = "retarget_bench_file_"
_MARKS: dict[Kind, tuple[str, ...]] = {
    "methods": ("retarget",),
    "metrics": ("compute", "extract", "features"),
    "datasets": ("cases",),
    "posts": ("process",),
}
_FILES: dict[Path, PluginEntry] = {}


@dataclass(frozen=True)
class PluginEntry:
    """One plug-in that can be used.

    origin:    ``built-in``, the distribution and its version, or the file's path.
    module:    what is imported for it.
    attribute: the factory's name in that module.
    path:      its file, or its folder's ``__init__.py``; None where it could not be found.
    """

    name: str
    kind: Kind
    origin: str
    module: str
    attribute: str = "plugin"
    path: Path | None = None

    @property
    def summary(self) -> str:
        """The first line of the module's docstring, read without importing it."""
        if self.path is None:
            return f"cannot be imported: no module {self.module}"
        try:
            text = ast.get_docstring(ast.parse(self.path.read_bytes()))
        except (OSError, SyntaxError, ValueError) as error:
            return f"cannot be read: {error}"
        return text.splitlines()[0] if text else ""

    @property
    def title(self) -> str:
        """The name as people write it: ``title`` of the card in its file, read without importing it, else
        the plug-in's name with spaces."""
        try:
            tree = ast.parse(self.path.read_bytes() if self.path else b"")
        except (OSError, SyntaxError, ValueError):
            tree = ast.parse("")
        calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
        cards = (node for node in calls if getattr(node.func, "id", "") == "MethodCard")
        for each in (keyword for card in cards for keyword in card.keywords if keyword.arg == "title"):
            if isinstance(each.value, ast.Constant):
                return str(each.value.value)
        return self.name.replace("_", " ")

    @property
    def by_file(self) -> bool:
        """Whether it was named by its file."""
        return self.module.startswith(_FILE_MODULE)

    @property
    def code_files(self) -> set[Path]:
        """The Python files whose text decides what it does; nothing is imported.

        A built-in or a single file: itself, and what it reaches by relative imports. An installed plug-in:
        every file of the package that it lies in. Raises BenchError where it has no source file.
        """
        if self.path is None:
            raise BenchError(f"{self}: no source file of module {self.module} was found")
        installed = self.origin != BUILT_IN and not self.by_file
        return own_files(self.path, self.module if installed else "")

    def __str__(self) -> str:
        return f"{SINGULAR[self.kind]} {self.name} ({self.origin})"


# -------------------------------------------------------------------------------------------- finding
def names(kind: Kind) -> list[PluginEntry]:
    """Every plug-in of a kind, sorted by name, built-ins first, none of them imported."""
    rooms = [Path(base) / ROOMS[kind] for base in retarget_bench.__path__]
    built_in = [entry for room in rooms for entry in _in_room(kind, room)]
    by_file = [entry for entry in _FILES.values() if entry.kind == kind]
    entries = [*built_in, *_installed(kind), *by_file]
    return sorted(entries, key=lambda entry: (entry.name, entry.origin != BUILT_IN, entry.origin))


def find(kind: Kind, name: str) -> PluginEntry:
    """The plug-in of this name, however it is spelled (``HuMoT``); raises BenchError with close names, or
    with both origins of two."""
    entries = names(kind)
    matching = _matching(name, entries)
    if len(matching) == 1:
        return matching[0]
    if matching:
        origins = " and ".join(entry.origin for entry in matching)
        raise BenchError(f"two {kind} are called {name!r}: {origins}; rename or uninstall one of them")
    others = [SINGULAR[k] for k in KINDS if k != kind and any(e.name == name for e in names(k))]
    elsewhere = f" ({name} is a {others[0]})" if others else ""
    raise BenchError(f"no {SINGULAR[kind]} is called {name!r}; {_cure(name, entries)}{elsewhere}")


def kinds_of(name: str) -> list[Kind]:
    """The kinds that have a plug-in of this name, mostly one; raises BenchError where none has."""
    everything = [entry for kind in KINDS for entry in names(kind)]
    kinds = list(dict.fromkeys(entry.kind for entry in _matching(name, everything)))
    if not kinds:
        raise BenchError(f"nothing is called {name!r}; {_cure(name, everything)}")
    return kinds


def _matching(name: str, entries: list[PluginEntry]) -> list[PluginEntry]:
    """The plug-ins of exactly this name; where there are none, those that differ from it in spelling."""
    exactly = [entry for entry in entries if entry.name == name]
    return exactly or [entry for entry in entries if folded(entry.name) == folded(name)]


def code_files(kind: Kind, name: str) -> set[Path]:
    """``code_files`` of the plug-in of this name. Raises BenchError."""
    return find(kind, name).code_files


def spelled(text: str, kinds: tuple[Kind, ...] = KINDS) -> str:
    """A spec as people write it, such as ``copy rotations[root_rule=none]``, with the plug-in's own name.

    Case, spaces, underscores and hyphens do not count, and a title may stand for the name. A text that is
    no plug-in's name is given back.
    """
    name = re.split(r"[\[+@]", text.strip())[0]
    entries = [entry for kind in kinds for entry in names(kind)]
    matches = _matching(name, entries) or [e for e in entries if folded(e.title) == folded(name)]
    return matches[0].name + text.strip().removeprefix(name) if matches else text


def _cure(name: str, entries: list[PluginEntry]) -> str:
    """Advice for an unknown name: close names, else all."""
    existing = sorted({entry.name for entry in entries})
    close = [each for each in existing if each.startswith(name.casefold())]
    close = close or difflib.get_close_matches(name.casefold(), existing, 3, 0.7)
    return f"did you mean {' or '.join(close)}?" if close else f"known are {', '.join(existing) or 'none'}"


@cache
def _in_room(kind: Kind, room: Path) -> tuple[PluginEntry, ...]:
    entries = []
    for path in sorted(room.iterdir()) if room.is_dir() else ():
        file = file_of(path)
        if path.name[0] not in "_." and file.suffix == ".py" and file.is_file():
            module = f"retarget_bench.{ROOMS[kind].replace('/', '.')}.{path.stem}"
            entries.append(PluginEntry(path.stem, kind, BUILT_IN, module, path=file))
    return tuple(entries)


@cache
def _installed(kind: Kind) -> tuple[PluginEntry, ...]:
    from importlib.metadata import entry_points

    entries: dict[PluginEntry, None] = {}
    for point in entry_points(group=f"retarget_bench.{kind}"):
        origin = f"{point.dist.name} {point.dist.version}" if point.dist else "an installed package"
        where = point.module, point.attr or "plugin", _locate(point.module)
        entries[PluginEntry(point.name, kind, origin, *where)] = None
    return tuple(entries)


def _locate(module: str) -> Path | None:
    """A module's source file, found without importing it or the packages around it."""
    search: list[str] | None = None
    spec = None
    for name in accumulate(module.split("."), "{}.{}".format):
        finders = (getattr(finder, "find_spec", None) for finder in sys.meta_path)
        spec = next((s for find in finders if find and (s := find(name, search)) is not None), None)
        if spec is None:
            return None
        search = list(spec.submodule_search_locations or ())
    return Path(spec.origin) if spec and spec.origin and spec.origin.endswith(".py") else None


# ---------------------------------------------------------------------------------------- named files
def add_file(path: str | Path) -> PluginEntry:
    """Make the plug-in in a ``.py`` file (or in a folder with an ``__init__.py``) known by its stem.

    The attributes of its ``plugin`` decide its kind: ``retarget``, ``compute``, ``kept`` or ``features``,
    ``cases``, or ``process``; so the file is imported here. Adding it again changes nothing. Raises
    BenchError.
    """
    path = Path(path).resolve()
    if path in _FILES:
        return _FILES[path]
    entry, file = file_entry(path), file_of(path)
    if not file.is_file() or file.suffix != ".py" or not NAME.fullmatch(path.stem):
        what = "is not a plug-in" if path.exists() else "no such plug-in file"
        raise BenchError(
            f"{path}: {what}; it is a .py file or a folder with an __init__.py, named with letters, "
            "digits and _.-"
        )
    factory = _factory(entry)
    kind = next((k for k, marks in _MARKS.items() if any(hasattr(factory, mark) for mark in marks)), None)
    if kind is None:
        raise BenchError(
            f"{path}: its plugin has none of retarget (a method), compute (a metric), cases (a data set) "
            "and process (a post-processor)"
        )
    _FILES[path] = replace(entry, kind=kind)
    return _FILES[path]


def file_of(path: Path) -> Path:
    """The file of a plug-in that is one file or a folder."""
    return path / "__init__.py" if path.is_dir() else path


def file_entry(path: Path, kind: Kind = "methods") -> PluginEntry:
    """The plug-in in a file or folder. kind: the right one where it is known.

    The name of its module moves when its code does, so that it is imported anew.
    """
    file = file_of(path)
    code = [each.read_bytes() for each in sorted(own_files(file))] if file.is_file() else []
    module = f"{_FILE_MODULE}{path.stem}_{files_.digest(repr((path, code)), 24)}"
    return PluginEntry(path.stem, kind, str(path), module, path=file)


def refresh_files() -> None:
    """Import added files anew whose code has changed, and forget those that are gone. Raises BenchError."""
    for path, entry in list(_FILES.items()):
        if file_entry(path).module != entry.module:
            del _FILES[path]
            if file_of(path).is_file():
                for file in entry.code_files:  # a second file of one second and size has the same bytecode
                    Path(importlib.util.cache_from_source(str(file))).unlink(missing_ok=True)
                add_file(path)


def files() -> tuple[tuple[str, Kind], ...]:
    """The plug-in files that were added, with the kind of each, for handing on to other processes."""
    return tuple((str(path), entry.kind) for path, entry in _FILES.items())


def know_files(files: Iterable[tuple[str, Kind]]) -> None:
    """Make plug-in files known that another process has added; they are imported when they are used."""
    for file, kind in files:
        _FILES.setdefault(Path(file), file_entry(Path(file), kind))


# -------------------------------------------------------------------------------------------- loading
def load(kind: Kind, name: str) -> Callable[..., Any]:
    """The factory of a plug-in, imported now; raises BenchError naming the plug-in and its origin."""
    return _factory(find(kind, name))


def _factory(entry: PluginEntry) -> Callable[..., Any]:
    """Raises BenchError."""
    try:
        with redirect_stdout(sys.stderr):  # what plug-ins print is no part of a table
            factory = _import_file(entry) if entry.by_file else importlib.import_module(entry.module)
    except (Exception, SystemExit) as error:
        raise _broken(entry, "imported", error) from error
    for part in entry.attribute.split("."):
        factory = getattr(factory, part, None)
    if not callable(factory):
        module = "it" if entry.by_file else f"module {entry.module}"  # whose name for a file is our own
        raise BenchError(
            f"{entry}: {module} has no {entry.attribute} that can be called; "
            f"a plug-in's module ends with a line such as {entry.attribute} = MyMethod"
        )
    return factory


def _import_file(entry: PluginEntry) -> Any:
    if entry.module in sys.modules:
        return sys.modules[entry.module]
    spec: Any = importlib.util.spec_from_file_location(entry.module, entry.path)
    module = sys.modules[entry.module] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[entry.module]
        raise
    return module


def canonical(kind: Kind, spec: Spec | str) -> Spec:
    """The spec with typed values and without those that equal a default, and so its post-processors;
    raises BenchError, also where what is no method is given some."""
    spec = Spec.parse(spec)
    if spec.posts and kind != "methods":
        several = "; several at once are for bench train alone" if kind == "datasets" else ""
        raise BenchError(
            f"{spec}: post-processors follow a method, and this is a {SINGULAR[kind]}{several}"
        )
    if spec.environment and kind != "methods":
        raise BenchError(f"{spec}: an environment is for methods, and this is a {SINGULAR[kind]}")
    name = find(kind, spec.name).name
    fitted = parameters.fit(Spec(name, spec.parameters), load(kind, name))
    return replace(
        fitted, posts=tuple(canonical("posts", post) for post in spec.posts), environment=spec.environment
    )


def create(kind: Kind, spec: Spec | str) -> Any:
    """The plug-in object for a spec, built with its parameters; a method with its post-processors as one.

    Raises BenchError: unknown names and parameters with the known ones; whatever the plug-in's own code
    raises, with its origin. A BenchError of the plug-in passes as it is.
    """
    from retarget_bench.api import Dataset, Method
    from retarget_bench.api.completing import complete
    from retarget_bench.api.metrics import contract_of
    from retarget_bench.plugins.post_processors import Composed, Post

    spec = canonical(kind, spec)
    if spec.environment:
        raise BenchError(
            f"{spec}: methods answer in other environments in bench run alone; leave out what follows the @"
        )
    if spec.posts:
        return Composed(create(kind, spec.alone), [create("posts", post) for post in spec.posts])
    factory = load(kind, spec.name)
    try:
        with redirect_stdout(sys.stderr):
            built = factory(**spec.parameters)
            if not hasattr(built, "card"):
                at = "see retarget_bench/api/ for what it needs"
                raise BenchError(f"{find(kind, spec.name)} has no card; {at}")
            contracts: dict[str, type] = {"methods": Method, "datasets": Dataset, "posts": Post}
            return complete(built, contracts.get(kind) or contract_of(built))
    except BenchError:
        raise
    except Exception as error:
        raise _broken(find(kind, spec.name), f"built as {spec}", error) from error


def working(kind: Kind) -> tuple[dict[str, Any], list[str]]:
    """Every plug-in of a kind that can be built as it is, by name, and a sentence for each broken one.

    Those that must be given a parameter are in neither.
    """
    plugins: dict[str, Any] = {}
    problems: dict[str, None] = {}
    for entry in names(kind):
        try:
            factory = load(kind, entry.name)
            if not any(each.required for each in parameters.known(factory)[0]):
                plugins[entry.name] = create(kind, entry.name)
        except BenchError as error:
            problems[str(error)] = None
    return plugins, list(problems)


def _broken(entry: PluginEntry, what: str, error: BaseException) -> BenchError:
    """The error to raise when plug-in code failed."""
    lines = [each.strip() for each in str(error).splitlines() if each.strip()]
    return BenchError(f"{entry} could not be {what}: {': '.join([type(error).__name__, *lines[:2]])}")
