"""The rules that make the architecture, and what an installed copy holds and costs."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest

from retarget_bench.training.released import LIST, listed

ROOT = Path(__file__).parents[1]
ENGINE = ROOT / "retarget_bench"
ROOMS = ("methods", "metrics", "datasets")
INSIDE = {"": "retarget_bench", **{room: room for room in ROOMS}, "golden": "results/golden"}
"""Folder in the wheel's package -> folder in a checkout."""
FETCHED = listed(ROOT / "methods" / LIST)
LARGEST_WHEEL = 60_000_000


def python_files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.rglob("*.py") if "__pycache__" not in p.parts)


@cache
def tree(file: Path) -> ast.Module:
    return ast.parse(file.read_bytes())


def imports(file: Path) -> Iterator[str]:
    """Every module that a file imports, relative ones with their dots."""
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            dot = "." if node.module else ""
            yield from (f"{module}{dot}{alias.name}" for alias in node.names)


VARIANTS = {
    "methods/nkn_cross": "methods/nkn",
    "methods/pmnet_cross": "methods/pmnet",
    "metrics/fid_structure": "metrics/fid",
}
"""A plug-in that is another one with a difference -> that one: the only plug-in that it may import."""


def leaf(path: Path) -> str:
    """``methods/pan`` of what is in that folder; each of the posts is one of its own."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return "/".join(parts[: 3 if parts[1:2] == ("posts",) else 2])


def other_plug_ins(file: Path) -> Iterator[str]:
    """The other plug-ins of which a plug-in's file imports something, for types too."""
    for name in imports(file):
        level = len(name) - len(name.lstrip("."))
        if level:
            folder, parts = file.parents[level - 1], name.lstrip(".").split(".")
            if leaf(folder / parts[0]) != leaf(file):
                yield leaf(folder.joinpath(*parts))
        for room in ROOMS:
            if name.startswith(f"retarget_bench.{room}."):
                yield f"{room}/{name.split('.')[2]}"


def test_a_plug_in_imports_no_other_but_the_one_that_it_is_a_variant_of():
    """What two plug-ins need stands in the engine; what learned methods need, in ``training/layers``."""
    importing = {
        (leaf(file), other)
        for room in ROOMS
        for file in python_files(ROOT / room)
        for other in other_plug_ins(file)
    }
    assert importing == set(VARIANTS.items())


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_code_of_a_variant_is_known_by_that_of_the_other_too(variant):
    from retarget_bench.plugins import registry

    kind, name = variant.split("/")
    files = {path.resolve() for path in registry.code_files(kind, name)}
    other = ROOT / VARIANTS[variant]
    assert files & set(python_files(other))
    assert ROOT / variant / "__init__.py" in files


def relative_imports(file: Path) -> Iterator[str]:
    """The modules and names of the engine that a file imports, for types too: ``plugins.spec.Spec``."""
    for name in imports(file):
        assert not name.startswith("."), f"{file}: {name}: the engine writes its imports out in full"
        if name.startswith("retarget_bench."):
            yield name.removeprefix("retarget_bench.")


def module_of(file: Path) -> str:
    """``plugins.spec``; a package goes by its own name."""
    parts = file.relative_to(ENGINE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def test_every_module_says_what_it_is_and_is_short():
    silent, long = [], []
    for file in (p for base in (ENGINE, *(ROOT / room for room in ROOMS)) for p in python_files(base)):
        if not ast.get_docstring(tree(file)):
            silent.append(str(file))
        if file.read_bytes().count(b"\n") > 400:
            long.append(str(file))
    assert not silent, "modules without a docstring"
    assert not long, "modules of more than 400 lines"


(LISTED,) = re.findall(
    r"```text imports\n(.*?)```", (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"), re.DOTALL
)
ORDER = tuple(re.findall(r"\w+", LISTED))
"""Each may import those before it."""


def engine_files() -> list[Path]:
    """The engine without its templates, which are plug-ins."""
    return [file for file in python_files(ENGINE) if "templates" not in file.parts]


def test_the_engine_imports_no_plug_in():
    forbidden = tuple(f"{room}." for room in ROOMS)
    assert not [
        f"{module_of(file)} imports {name}"
        for file in engine_files()
        for name in relative_imports(file)
        if name.startswith(forbidden) or name in ROOMS
    ]


def test_packages_import_in_one_direction():
    rank = {name: number for number, name in enumerate(ORDER)}
    offences = []
    for file in engine_files():
        own_package = module_of(file).split(".")[0]
        for name in relative_imports(file):
            other_package = name.split(".")[0]
            if (
                own_package not in ("", "__main__", other_package)
                and other_package in rank
                and rank[other_package] > rank[own_package]
            ):
                offences.append(f"{module_of(file)} imports {name}")
    assert not offences
    packages = {module_of(file).split(".")[0] for file in engine_files()} - {"", "__main__"}
    assert packages == set(ORDER)


def test_modules_do_not_import_each_other_in_a_circle():
    modules = {module_of(file) for file in engine_files()}
    needs = {
        module_of(file): {
            next(each for each in (name, name.rpartition(".")[0], "") if each in modules)
            for name in relative_imports(file)
        }
        - {"", module_of(file)}
        for file in engine_files()
    }
    while free := {module for module, needed in needs.items() if not needed}:
        needs = {module: needed - free for module, needed in needs.items() if module not in free}
    left = {module for module in needs if not module.startswith("report.")}
    while free := {m for m in left if not any(m in needs[other] for other in needs if other != m)}:
        left -= free  # imported by none of the rest: it waits for a circle and is in none
        needs = {module: needed for module, needed in needs.items() if module not in free}
    assert not left


WORDS = {
    *("cmu", "contact", "contact_speed", "external", "fid", "fit", "folder", "ground", "growth"),
    *("identity", "mixamo", "paired", "papers", "position", "reference", "restoration", "rotation"),
    *("same", "skin", "slide", "smoothness", "touch"),
}
"""Names of plug-ins that are words of the field, or ids of values, as well."""


def test_the_engine_names_plug_ins_in_defaults_alone():
    folders = (ROOT / room for room in (*ROOMS, "methods/posts"))
    plug_ins = {path.stem for folder in folders for path in folder.iterdir() if path.suffix in ("", ".py")}
    plug_ins -= WORDS | {"posts", "__pycache__", "__init__"}
    written = re.compile(rf"({'|'.join(sorted(plug_ins))})(\[.*)?")
    offences = []
    for file in engine_files():
        parsed = tree(file)
        docs = {id(n.value) for n in ast.walk(parsed) if isinstance(n, ast.Expr)}
        offences += [
            f"{module_of(file)}, line {node.lineno}: {node.value!r}"
            for node in ast.walk(parsed)
            if isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in docs
            and written.fullmatch(node.value)
            and module_of(file) != "defaults"
        ]
    assert not offences


def test_plug_ins_import_only_the_engine_their_own_siblings_and_third_parties():
    offences = []
    for room in (ROOT / room for room in ROOMS):
        for file in python_files(room):
            depth = len(file.relative_to(room).parts)
            for name in imports(file):
                second = name.split(".")[1] if name.startswith("retarget_bench.") else ""
                out = len(name) - len(name.lstrip(".")) > depth
                other = name.startswith((*(f"{each}." for each in ROOMS), "tests."))
                unknown = second and second not in ORDER
                if out or other or unknown or second in ("commands", "cli"):
                    offences.append(f"{file.relative_to(ROOT).as_posix()} imports {name}")
    assert not offences


def test_no_init_lies_directly_in_a_room():
    assert not [room for room in ROOMS if (ROOT / room / "__init__.py").exists()]


# ------------------------------------------------------------------------------------- cost of imports
def modules_after(code: str) -> set[str]:
    report = f"{code}\nimport sys, json\nprint(json.dumps(sorted(sys.modules)))"
    completed = subprocess.run(
        [sys.executable, "-c", report], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return set(json.loads(completed.stdout.splitlines()[-1]))


HEAVY = {"torch", "scipy", "pandas", "matplotlib", "pydantic", "tqdm"}


def test_the_package_itself_imports_nothing_heavy():
    assert not modules_after("import retarget_bench") & (HEAVY | {"numpy", "click"})


def test_light_commands_import_neither_numpy_nor_a_plug_in():
    """All in one process: what one of them had imported would still be there after the last."""
    code = """
from retarget_bench.cli import main
for command in ("--help", "list", "--version", "run --help", "new --help"):
    try:
        main(command.split())
    except SystemExit as stop:
        assert stop.code == 0, (command, stop.code)
"""
    loaded = modules_after(code)
    assert not loaded & (HEAVY | {"numpy"})
    assert not [
        name for name in loaded if name.startswith(tuple(f"retarget_bench.{room}." for room in ROOMS))
    ]


def test_the_evaluation_side_needs_numpy_only():
    """All in one process, likewise."""
    modules = (
        "api",
        "evaluation.predict",
        "evaluation.score",
        "evaluation.plan",
        "evaluation.runner",
        "api.comparison",
        "results.store",
        "tables.builder",
        "verification.contract",
    )
    loaded = modules_after("import " + ", ".join(f"retarget_bench.{name}" for name in modules))
    assert loaded >= {f"retarget_bench.{name}" for name in modules}
    assert not loaded & HEAVY


# ----------------------------------------------------------------------------------------------- wheel
@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """A wheel of the folders as they are, built from a copy so that nothing old gets in."""
    if find_spec("setuptools") is None:
        pytest.skip("building the wheel needs setuptools in this environment")
    copy = tmp_path_factory.mktemp("source")
    for name in INSIDE.values():
        shutil.copytree(
            ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info")
        )
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    folder = tmp_path_factory.mktemp("wheel")
    build = "import sys; from setuptools.build_meta import build_wheel; build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", build, folder], cwd=copy, check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


def test_the_wheel_holds_what_the_folders_hold(wheel):
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    expected = {
        (Path("retarget_bench") / there / p.relative_to(ROOT / here)).as_posix()
        for there, here in INSIDE.items()
        for p in (ROOT / here).rglob("*")
        if p.is_file() and "__pycache__" not in p.parts
    }
    fetched = {Path("retarget_bench/methods", *each).as_posix() for each in FETCHED}
    assert fetched < expected
    assert packed == expected - fetched, "a new kind of file is named in package-data of pyproject.toml"
    assert wheel.stat().st_size < LARGEST_WHEEL


def test_an_unpacked_wheel_lists_the_same_plug_ins(wheel, tmp_path):
    zipfile.ZipFile(wheel).extractall(tmp_path)
    command = [sys.executable, "-m", "retarget_bench", "list"]
    there = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    here = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert there.stdout == here.stdout
    code = "import retarget_bench, retarget_bench.methods.copy_rotations as c; print(c.__file__)"
    place = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert Path(place.stdout.strip()) == tmp_path / "retarget_bench" / "methods" / "copy_rotations.py"


@pytest.mark.parametrize(
    ("methods", "least"),
    [(("copy_rotations", "ik"), 300), pytest.param((), 3000, marks=pytest.mark.slow)],
    ids=["some", "all"],
)
def test_an_unpacked_wheel_passes_its_own_gate_on_another_processor(wheel, tmp_path, methods, least):
    """From an empty cache, without the puppets' generator, without vector instructions, with other linear
    algebra."""
    zipfile.ZipFile(wheel).extractall(tmp_path)
    shutil.rmtree(tmp_path / "retarget_bench" / "datasets" / "puppets" / "generator")
    other = {
        "NPY_DISABLE_CPU_FEATURES": "X86_V4 X86_V3 AVX512_SKX AVX512F AVX2 FMA3",
        "OPENBLAS_CORETYPE": "Prescott",
        "RETARGET_BENCH_CACHE": str(tmp_path / "cache"),
    }
    options = [word for method in methods for word in ("--methods", method)]
    completed = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "retarget_bench", "check", *options],
        cwd=tmp_path,
        env=os.environ | other,
        capture_output=True,
        text=True,
    )
    assert completed.returncode == 0, completed.stdout + completed.stderr
    rows = re.search(r"^(\d+) compared: \1 same, 0 not\.$", completed.stdout, re.MULTILINE)
    assert rows is not None
    assert int(rows[1]) > least


def test_versions_and_names_agree():
    from retarget_bench import __version__

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"]["bench"] == project["scripts"]["retarget-bench"]
    assert f"version: {__version__}" in (ROOT / "CITATION.cff").read_text()
    assert f"## {__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_every_dependency_is_pinned():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    pins = dict(re.findall(r"^([a-z0-9-]+)==(\S+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE))
    requirements = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    names = {re.split(r"[><=\[ ]", each)[0].lower().replace("_", "-") for each in requirements}
    assert names <= set(pins)


# ------------------------------------------------------------------------------------------------ workflows
def test_workflows_test_every_python_that_is_promised_and_run_the_gate():
    import yaml

    ci, check = (yaml.safe_load((ROOT / ".github/workflows" / name).read_text()) for name in
                 ("ci.yml", "check.yml"))  # fmt: skip
    assert ci["jobs"]["test"]["strategy"]["matrix"]["python"] == ["3.11", "3.12", "3.13"]
    steps = [step.get("run", "") for step in ci["jobs"]["test"]["steps"]]
    assert any(step.startswith("make test") for step in steps)
    assert 'bench check --summary "$GITHUB_STEP_SUMMARY"' in [
        step.get("run") for step in check["jobs"]["check"]["steps"]
    ]
    assert re.search(r"^\t\$\(MAKE\).* check$", (ROOT / "Makefile").read_text(), re.MULTILINE)
