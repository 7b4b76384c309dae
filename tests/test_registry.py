"""Plug-ins are found without being imported, and a bad one hurts nobody else."""

from __future__ import annotations

from pathlib import Path

import pytest

from retarget_bench.errors import BenchError
from retarget_bench.plugins import parameters, registry

METHOD = '''"""Turns nothing into nothing."""
from __future__ import annotations
from typing import Literal


class Idle:
    class card:
        parameters = {"rule": "which way to idle"}

    def __init__(self, rule: Literal["left", "right"] = "left", speed: float = 1, steps: int = 3,
                 root: str | None = None, loud: bool = False):
        self.got = dict(rule=rule, speed=speed, steps=steps, root=root, loud=loud)

    def retarget(self, source, target, *, context):
        return None


plugin = Idle
'''


@pytest.fixture(autouse=True)
def _no_files(monkeypatch):
    monkeypatch.setattr(registry, "_FILES", {})


@pytest.fixture
def idle(tmp_path) -> Path:
    file = tmp_path / "idle.py"
    file.write_text(METHOD)
    registry.add_file(file)
    return file


def write(folder: Path, name: str, text: str) -> Path:
    file = folder / f"{name}.py"
    file.write_text(text)
    return file


@pytest.mark.parametrize("kind", registry.KINDS)
def test_built_in_names_are_the_files_of_the_room(kind):
    room = Path(__file__).parents[1] / registry.ROOMS[kind]
    expected = {p.stem for p in room.glob("*.py") if p.name[0] != "_"}
    expected |= {p.parent.name for p in room.glob("*/__init__.py") if p.parent.name[0] != "_"}
    by_name = {e.name: e for e in registry.names(kind) if e.origin == registry.BUILT_IN}
    assert set(by_name) == expected
    for entry in by_name.values():
        assert entry.path is not None
        first = entry.path.read_text(encoding="utf-8").splitlines()[0]
        assert first.strip('"') == entry.summary != ""


def test_a_file_is_known_by_its_stem_and_by_what_it_does(tmp_path, idle):
    (entry,) = (e for e in registry.names("methods") if e.name == "idle")
    assert (entry.kind, entry.summary) == ("methods", "Turns nothing into nothing.")
    assert registry.files() == ((str(idle), "methods"),)
    assert registry.add_file(idle) == entry
    assert registry.files() == ((str(idle), "methods"),)
    metric = write(tmp_path, "odd", "class M:\n    def compute(self, c): ...\nplugin = M\n")
    data = write(tmp_path, "set", "class D:\n    def cases(self, task, split): ...\nplugin = D\n")
    assert registry.add_file(metric).kind == "metrics"
    assert registry.add_file(data).kind == "datasets"
    post = write(tmp_path, "then", "class P:\n    def process(self, p, s, *, context): ...\nplugin = P\n")
    assert registry.add_file(post).kind == "posts"


def test_a_folder_is_a_plug_in_file_too(tmp_path):
    folder = tmp_path / "wide"
    folder.mkdir()
    write(folder, "__init__", "from .inner import plugin\n")
    write(folder, "inner", METHOD)
    assert registry.add_file(folder).name == "wide"
    assert registry.create("methods", "wide[steps=4]").got["steps"] == 4
    assert {path.name for path in registry.code_files("methods", "wide")} == {"__init__.py", "inner.py"}


def test_parameters_get_the_type_that_the_signature_asks_for(idle):
    got = registry.create("methods", "idle[rule=right,speed=2,steps=4.0,root=7,loud=true]").got
    assert got == {"rule": "right", "speed": 2.0, "steps": 4, "root": "7", "loud": True}
    assert [type(v) for v in got.values()] == [str, float, int, str, bool]


def test_the_canonical_spec_leaves_defaults_out(idle):
    assert str(registry.canonical("methods", "idle[steps=3,speed=1,rule=left]")) == "idle"
    assert str(registry.canonical("methods", "idle[speed=2]")) == "idle[speed=2.0]"
    assert registry.canonical("methods", "idle[speed=2.0]") == registry.canonical(
        "methods", "idle[speed=2]"
    )


@pytest.mark.parametrize(
    ("spec", "texts"),
    [
        (
            "idle[sped=2]",
            ["no parameter 'sped'", "did you mean speed?", "rule=left|right", "which way to idle"],
        ),
        ("idle[rule=up]", ["does not take rule=up", "rule=left|right (default left)"]),
        ("idle[steps=2.5]", ["does not take steps=2.5", "steps=int (default 3)"]),
        ("idle[speed=fast]", ["does not take speed=fast", "speed=float"]),
        ("idle[loud=1]", ["does not take loud=1", "loud=bool (default false)"]),
    ],
)
def test_wrong_parameters_are_answered_with_the_known_ones(idle, spec, texts):
    with pytest.raises(BenchError) as caught:
        registry.create("methods", spec)
    for text in texts:
        assert text in str(caught.value)


PRESET = '''"""Parameters in a dataclass."""
from __future__ import annotations
from dataclasses import asdict, dataclass
from typing import Literal


@dataclass(frozen=True)
class Config:
    rule: Literal["left", "right"] | None = None
    speed: float | None = None
    loud: bool = False


class Preset:
    class card:
        parameters = {"speed": "how fast"}

    Config = Config

    def __init__(self, **parameters):
        self.got = asdict(Config(**parameters))

    def retarget(self, source, target, *, context):
        return None


plugin = Preset
'''


def test_the_fields_of_a_config_are_parameters_like_any_other(tmp_path):
    registry.add_file(write(tmp_path, "preset", PRESET))
    created = registry.create("methods", "preset[rule=left,speed=2]")
    assert created.got == {"rule": "left", "speed": 2.0, "loud": False}
    spec = registry.canonical("methods", "preset[loud=false,speed=1]")
    assert str(spec) == "preset[speed=1.0]", "defaults are left out"
    shown = parameters.describe(registry.load("methods", "preset"))
    assert shown == ["rule=left|right", "speed=float: how fast", "loud=bool (default false)"]
    for wrong, texts in {
        "preset[rule=lef]": ("did you mean left", "rule=left|right"),
        "preset[speed=fast]": ("speed=fast", "speed=float"),
        "preset[sped=1]": ("no parameter", "did you mean speed"),
    }.items():
        with pytest.raises(BenchError) as caught:
            registry.create("methods", wrong)
        assert all(text in str(caught.value) for text in texts)


def test_a_field_without_a_default_is_asked_for(tmp_path):
    text = PRESET.replace("loud: bool = False", "").replace("    rule:", "    loud: bool\n    rule:")
    registry.add_file(write(tmp_path, "preset", text))
    with pytest.raises(BenchError, match="preset needs loud"):
        registry.create("methods", "preset")


def test_a_class_config_that_is_no_dataclass_is_the_plug_ins_own_affair(tmp_path):
    text = "class M:\n    class Config:\n        x = 1\n    def __init__(self, size: int = 3): ...\n"
    registry.add_file(write(tmp_path, "own", text + "    def retarget(self): ...\nplugin = M\n"))
    assert parameters.describe(registry.load("methods", "own")) == ["size=int (default 3)"]


def test_a_required_parameter_is_asked_for(tmp_path):
    source = (
        "class D:\n    def __init__(self, root: str): ...\n    def cases(self, t, s): ...\nplugin = D\n"
    )
    registry.add_file(write(tmp_path, "needy", source))
    with pytest.raises(BenchError, match=r"needy needs root: write needy\[root=\.\.\.\]"):
        registry.create("datasets", "needy")


def test_an_unknown_name_lists_close_ones(idle):
    with pytest.raises(BenchError, match="no method is called 'idel'; did you mean idle"):
        registry.load("methods", "idel")
    with pytest.raises(BenchError, match=r"\(idle is a method\)"):
        registry.load("metrics", "idle")
    with pytest.raises(BenchError, match="nothing is called 'idel'; did you mean idle"):
        registry.kinds_of("idel")


def test_the_same_name_twice_names_both_origins(tmp_path, idle):
    (tmp_path / "elsewhere").mkdir()
    other = write(tmp_path / "elsewhere", "idle", METHOD)
    registry.add_file(other)
    with pytest.raises(BenchError) as caught:
        registry.load("methods", "idle")
    assert str(idle) in str(caught.value)
    assert str(other) in str(caught.value)
    assert sum(e.name == "idle" for e in registry.names("methods")) == 2


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        (
            "import no_such_module_anywhere\n",
            "ModuleNotFoundError: No module named 'no_such_module_anywhere'",
        ),
        ("def broken(:\n", "SyntaxError"),
        ("raise SystemExit(3)\n", "SystemExit: 3"),
        ("plugin = 3\n", "has no plugin that can be called"),
        ("class plugin: pass\n", "has none of retarget"),
    ],
)
def test_a_broken_file_is_named_with_its_error(tmp_path, body, problem):
    file = write(tmp_path, "bad", body)
    with pytest.raises(BenchError) as caught:
        registry.add_file(file)
    assert problem in str(caught.value)
    assert str(file) in str(caught.value)
    assert registry.files() == ()


def test_an_error_in_building_is_isolated_but_a_sentence_passes(tmp_path):
    source = (
        "from retarget_bench.errors import BenchError\n"
        "class M:\n"
        "    def __init__(self, how='well'):\n"
        "        if how == 'badly': raise ValueError('seven\\nlines')\n"
        "        if how == 'never': raise BenchError('say well')\n"
        "    def retarget(self): ...\n"
        "plugin = M\n"
    )
    registry.add_file(write(tmp_path, "moody", source))
    with pytest.raises(
        BenchError, match=r"method moody \(.*\) could not be built as moody\[how=badly\]: ValueError"
    ):
        registry.create("methods", "moody[how=badly]")
    with pytest.raises(BenchError, match=r"^say well$"):
        registry.create("methods", "moody[how=never]")


def test_code_files_follow_relative_imports(tmp_path, monkeypatch):
    room = tmp_path / "methods"
    for name in ("wide", "shared"):
        (room / name).mkdir(parents=True)
    write(room, "one", '"""One."""\nfrom ._two import x\nfrom .shared import helper\nimport json\n')
    write(room, "_two", "def x():\n    from . import _three\n")
    write(room, "_three", "")
    write(room, "unrelated", "")
    write(room / "shared", "__init__", "")
    write(room / "shared", "helper", "from .._three import y\n")
    write(room / "wide", "__init__", "")
    write(room / "wide", "deep", "")
    monkeypatch.setattr("retarget_bench.__path__", [str(tmp_path)])
    one = {p.relative_to(room).as_posix() for p in registry.code_files("methods", "one")}
    assert one == {"_three.py", "_two.py", "one.py", "shared/__init__.py", "shared/helper.py"}
    assert {p.name for p in registry.code_files("methods", "wide")} == {"__init__.py", "deep.py"}


def test_helpers_with_an_underscore_are_no_plug_ins(tmp_path, monkeypatch):
    room = tmp_path / "metrics"
    room.mkdir()
    for name in ("good", "_helper"):
        write(room, name, '"""A line."""\n')
    (room / "_folder").mkdir()
    write(room / "_folder", "__init__", "")
    (room / "__pycache__").mkdir()
    write(room, "torn", "def (\n")
    monkeypatch.setattr("retarget_bench.__path__", [str(tmp_path)])
    monkeypatch.setattr(registry, "_installed", lambda kind: ())
    entries = registry.names("metrics")
    assert [e.name for e in entries] == ["good", "torn"]
    assert entries[1].summary.startswith("cannot be read")


def test_prints_of_a_plugin_stay_out_of_standard_output(tmp_path, capfd, monkeypatch):
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    file = tmp_path / "loud.py"
    file.write_text(
        "print('imported')\n"
        "class Loud:\n"
        "    card = None\n"
        "    def __init__(self): print('built')\n"
        "    def retarget(self): pass\n"
        "plugin = Loud\n"
    )
    registry.add_file(file)
    registry.create("methods", "loud")
    assert capfd.readouterr() == ("", "imported\nbuilt\n")
