"""Hashes of code move with what code says, and with nothing else."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.code_hash import (
    all_statements,
    code_hash,
    own_files,
    package_code,
    reached,
    statements,
)
from retarget_bench.plugins.spec import Spec

ROOT = Path(__file__).parents[2]
ROOMS = ("retarget_bench", "methods", "metrics", "datasets")
BLOCKS = """
async def one():
    async with two: import a
    async for b in c: import d
    else: import e
    match f:
        case g if h: import i
    try: import j
    except* k: import l
    else: import m
    finally: import n
    while o: import p
    else: import q
    if r: import s
    elif t: import u
    else: import v
    class W: import x
"""
SOURCE = '''"""A method."""

from __future__ import annotations

from retarget_bench.api import Method, MethodCard
from retarget_bench.motion.rotation import slerp as between

STEP = 3  # frames
"""How far apart."""


class Mine:
    """What it does."""

    def retarget(self, source):
        """Its answer."""
        text = "# no comment"
        return between(source, STEP), text
'''

SAME = {
    "comment": ("# frames", "# of the source"),
    "docstring": ("What it does.", "What it does, in other words,\n    on two lines."),
    "text below a name": ("How far apart.", "Steps."),
    "blank lines": ("class Mine:", "\n\nclass Mine:"),
    "trailing space": ("STEP = 3  # frames", "STEP = 3   "),
    "moved module": ("retarget_bench.motion.rotation", "retarget_bench.motion.turning"),
    "split import": (
        "import Method, MethodCard",
        "import MethodCard\nfrom retarget_bench.api.methods import Method",
    ),
}
OTHER = {
    "number": ("STEP = 3", "STEP = 4"),
    "text that looks like a comment": ("# no comment", "# a comment"),
    "imported name": ("slerp as between", "lerp as between"),
    "name that it gets": ("slerp as between", "slerp"),
    "import of somebody else": ("from __future__ import annotations", "import math"),
    "statement": ("return between", "yield between"),
    "indentation": ("        return between", "    return between"),
}


@pytest.mark.parametrize("name", SAME)
def test_what_says_nothing_changes_nothing(name):
    before, after = SAME[name]
    assert before in SOURCE
    assert statements(SOURCE.replace(before, after).encode()) == statements(SOURCE.encode())


@pytest.mark.parametrize("name", OTHER)
def test_what_says_something_else_changes_the_text(name):
    before, after = OTHER[name]
    assert before in SOURCE
    assert statements(SOURCE.replace(before, after).encode()) != statements(SOURCE.encode())


def test_all_statements_are_found_wherever_they_stand():
    """Those among the nodes that ``ast.walk`` visits, in every file here and in blocks of all kinds."""
    files = [path for folder in ROOMS for path in (ROOT / folder).rglob("*.py")]
    texts = [BLOCKS, *(path.read_text(encoding="utf-8") for path in files)]
    for tree in map(ast.parse, texts):
        nodes = [*all_statements(tree)]
        assert {*map(id, nodes)} == {id(node) for node in ast.walk(tree) if isinstance(node, ast.stmt)}
        assert len(nodes) == len({*map(id, nodes)})


def test_what_is_no_python_counts_byte_by_byte():
    assert statements(b"a b # c") != statements(b"a b # d")
    assert statements(b"x = 1 \xff") != statements(b"x = 1 \xfe")


def test_tables_beside_a_method_count(tmp_path):
    (tmp_path / "__init__.py").write_text("plugin = None\n")
    table = tmp_path / "variants.toml"
    table.write_text("[own]\nweight = 1.0\n")
    first = code_hash(own_files(tmp_path / "__init__.py"))
    table.write_text("[own]\nweight = 2.0\n")
    assert code_hash(own_files(tmp_path / "__init__.py")) != first
    (tmp_path / "alone.py").write_text("plugin = None\n")
    assert table in own_files(tmp_path / "alone.py")


def test_names_of_files_count_and_their_order_and_folder_do_not(tmp_path):
    paths = [tmp_path / "a.py", tmp_path / "sub" / "b.py"]
    for path in paths:
        path.parent.mkdir(exist_ok=True)
        path.write_text(SOURCE)
    first = code_hash(paths)
    assert first == code_hash(reversed(paths)) == code_hash([*paths, *paths])
    assert first != code_hash(paths[:1])
    assert first != code_hash([paths[0].rename(tmp_path / "c.py"), paths[1]])


# ------------------------------------------------------------------------------------- keys of results
@pytest.fixture
def own(tmp_path, monkeypatch):
    """A method and a metric of our own in a folder, with hashes that nobody remembers."""
    for kind, name in (("methods", "method"), ("metrics", "metric")):
        template = Path(registry.__file__).parent / "templates" / f"{name}.py"
        text = template.read_text(encoding="utf-8").replace(f"my_{name}", f"own_{name}")
        path = tmp_path / f"own_{name}.py"
        path.write_text(text, encoding="utf-8")
        monkeypatch.setattr(registry, "code_files", _files(registry.code_files, kind, f"own_{name}", path))
    return tmp_path


def _files(usual, kind, name, path):
    return lambda k, n: {path} if (k, n) == (kind, name) else usual(k, n)


def changed(path: Path, before: str, after: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert before in text
    path.write_text(text.replace(before, after), encoding="utf-8")


def method_code() -> str:
    bound.method_code.cache_clear()
    return bound.method_code(Spec("own_method"))


def test_a_method_is_known_by_its_statements_and_by_those_of_the_motion_room(own, monkeypatch):
    first = method_code()
    changed(own / "own_method.py", "One line", "A line")
    assert method_code() == first
    changed(own / "own_method.py", "version=", "licence='mine', version=")
    second = method_code()
    assert second != first
    some = package_code("motion") - {ROOT / "retarget_bench" / "motion" / "transfer.py"}
    monkeypatch.setattr(bound, "package_code", lambda name: some if name == "motion" else set())
    assert method_code() not in (first, second)


SHARED = "from retarget_bench.training.layers.masks import frame_mask\n"
OTHER_WAYS = (
    "import retarget_bench.training.layers.masks\n",
    "from retarget_bench.training import layers\n",
    "def late():\n    from retarget_bench.training.layers import exported\n",
)
NOT_SHARED = (
    "",
    "import retarget_bench.training\n",
    "from retarget_bench.training.layers_of_old import frame_mask\n",
    "from retarget_bench.training.weights import layers\n",
    "text = 'from retarget_bench.training.layers import exported'\n",
)


def without_a_layer(paths, package: str) -> set[Path]:
    layers = package_code(package)
    return {*(files := reached(paths, package))} - {*sorted(files & layers)[:1]}


@pytest.mark.parametrize("text", [SHARED, *OTHER_WAYS, *NOT_SHARED])
def test_shared_layers_count_for_methods_that_import_from_them(own, monkeypatch, text):
    path = own / "own_method.py"
    path.write_text(path.read_text(encoding="utf-8") + text, encoding="utf-8")
    first = method_code()
    monkeypatch.setattr(bound, "reached", without_a_layer)
    assert (method_code() != first) == (text not in NOT_SHARED)


def test_shared_layers_count_for_post_processors_likewise(own, tmp_path, monkeypatch):
    path = tmp_path / "own_post.py"
    path.write_text(SHARED, encoding="utf-8")
    monkeypatch.setattr(registry, "code_files", _files(registry.code_files, "posts", "own_post", path))
    alone, composed = Spec("own_method"), Spec("own_method", posts=(Spec("own_post"),))
    bound.method_code.cache_clear()
    first = bound.method_code(alone), bound.method_code(composed)
    monkeypatch.setattr(bound, "reached", without_a_layer)
    bound.method_code.cache_clear()
    assert bound.method_code(alone) == first[0]
    assert bound.method_code(composed) != first[1]


def reached_layers(kind: registry.Kind, name: str) -> set[str]:
    return layer_names(reached(registry.code_files(kind, name), bound.LAYERS))


def layer_names(files: set[Path]) -> set[str]:
    training = ROOT / "retarget_bench" / "training"
    return {file.relative_to(training).as_posix() for file in files if file.is_relative_to(training)}


def test_modules_that_a_run_has_imported_of_the_layers_are_among_those_that_count():
    """Against what Python itself imports, also late."""
    code = (
        "import sys; from retarget_bench.plugins import bound; "
        "from retarget_bench.plugins.spec import Spec; "
        "bound.method(Spec('san')).built.structures; import retarget_bench.methods.san.training; "
        "head = 'retarget_bench.training.'; "
        "print(*(m.removeprefix(head) for m in sys.modules if m.startswith(head + 'layers')))"
    )
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.replace(".", "/") for name in completed.stdout.split()}
    assert len(loaded) > 10
    reachable = {
        name.removesuffix(".py").removesuffix("/__init__") for name in reached_layers("methods", "san")
    }
    assert loaded <= reachable


def test_code_is_hashed_without_importing_it():
    assert {"layers/__init__.py", "layers/masks.py"} <= layer_names(package_code(bound.LAYERS))
    code = (
        "import sys; from retarget_bench.plugins.bound import method_code as code; "
        "from retarget_bench.plugins.spec import Spec; "
        "print(len(code(Spec('nkn'))), 'torch' in sys.modules)"
    )
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert completed.stdout.split() == ["8", "False"]


def test_what_keys_leave_out_of_the_motion_room_is_reached_by_no_method():
    """Formats of files and edits: no plug-in and no other module of the room imports the edits."""
    root = Path(bound.__file__).parents[2]
    rooms = [
        root / "retarget_bench" / "motion",
        *(root / room for room in ("methods", "metrics", "datasets")),
    ]
    files = [file for room in rooms for file in room.rglob("*.py")]
    assert len(files) > 100
    for file in files:
        if "editing" not in file.relative_to(root).parts:
            assert not reached([file], "motion.editing") & package_code("motion.editing"), file


def test_a_metric_is_known_by_its_statements_and_by_those_of_the_comparison(own, monkeypatch):
    built = bound.metrics(("position",)).built
    monkeypatch.setattr(bound.BoundMetrics, "built", built)

    def version() -> str:
        bound.metrics.cache_clear()
        return bound.metrics(("own_metric",)).versions["position"]

    first = version()
    changed(own / "own_metric.py", "One line", "A line")
    assert version() == first
    changed(own / "own_metric.py", "100 *", "99 *")
    second = version()
    assert second != first
    monkeypatch.setattr(bound, "package_code", lambda _: set())
    assert version() not in (first, second)
    monkeypatch.undo()
    bound.metrics.cache_clear()


DRAWN = bound.SETS, "draw.py", "MOST = 1200"


@pytest.mark.parametrize("name", ["fid_structure", "position"])
def test_the_drawing_of_sets_counts_for_set_metrics(tmp_path, monkeypatch, name):
    """With another constant stored values of sets are outdated, with another comment they are not."""
    package, file, constant = DRAWN
    copy = tmp_path / file
    (original,) = (path for path in package_code(package) if path.name == file)
    text = original.read_text(encoding="utf-8")

    def with_copy(files: set[Path]) -> set[Path]:
        return {copy if path == original else path for path in files}

    monkeypatch.setattr(bound, "package_code", lambda name: with_copy(package_code(name)))
    monkeypatch.setattr(bound, "reached", lambda paths, name: with_copy(reached(paths, name)))

    def version(text: str) -> str:
        copy.write_text(text, encoding="utf-8")
        bound.metrics.cache_clear()
        return bound.metrics((name,)).versions[name]

    assert constant in text
    first = version(text)
    assert version(text.replace(constant, f"{constant}  # windows")) == first
    assert (version(text.replace(constant, f"{constant}0")) != first) == (name == "fid_structure")
    bound.metrics.cache_clear()
