"""Suite files: the same words as flags, every mistake at once, flags win."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from retarget_bench import cli
from retarget_bench.commands.run import command
from retarget_bench.commands.suite import read_suite, schema
from retarget_bench.errors import FileError
from retarget_bench.options import declared
from retarget_bench.python.run_options import RunOptions

pytestmark = pytest.mark.usefixtures("in_process")

TOYS = Path(__file__).parent / "toys"


def test_the_same_words_as_the_command_line(tmp_path):
    file = tmp_path / "suite.toml"
    file.write_text(
        'methods = "ik"\ndataset = "mixamo[fps=60]"\nroot = "x"\nsplits = ["intra"]\njobs = 2\n'
    )
    assert read_suite(file) == {
        "methods": ["ik"], "dataset": "mixamo[fps=60]", "root": "x", "splits": ["intra"], "jobs": 2,
    }  # fmt: skip


def test_every_mistake_is_listed_with_its_place(tmp_path):
    file = tmp_path / "suite.toml"
    file.write_text('jobs = "two"\nsplit = ["intra"]\nmethods = ["a", 3]\noverwrite = "often"\nlimit = 0\n')
    with pytest.raises(FileError) as caught:
        read_suite(file)
    for words in (
        "jobs is",
        "split: there is no",
        "methods is",
        "overwrite",
        "limit is 0",
        "it may set jobs",
    ):
        assert words in str(caught.value)


def test_flags_win(tmp_path):
    file = tmp_path / "suite.toml"
    file.write_text(
        f'methods = ["{TOYS}/toy_method.py"]\ndataset = "{TOYS}/toy_cases.py[clips=1]"\nsplits = "intra"\n'
        f'metrics = ["position"]\nout = "{tmp_path}/from_suite"\njobs = 1\n'
    )
    from_suite = CliRunner().invoke(command, ["--suite", str(file)], catch_exceptions=False)
    assert from_suite.exit_code == 0
    assert "intra: 2 cases of 1 clip" in from_suite.output
    line = ["toy_method[does=picky]", "--suite", str(file), "--out", f"{tmp_path}/from_flags"]
    from_flags = CliRunner().invoke(command, line, catch_exceptions=False)
    assert "toy_method[does=picky]" in from_flags.output
    assert "1/2" in from_flags.output
    assert not list((tmp_path / "from_suite").rglob("*picky*"))


# ------------------------------------------------------------------------------------ the schema of editors
def test_the_schema_says_of_every_option_what_its_help_says():
    content = json.loads(CliRunner().invoke(cli.group, ["info", "suite"]).output)
    options = {name: each for name, each in declared(RunOptions).items() if not each.python}
    properties = content["properties"]
    assert list(properties) == list(options)
    assert all(properties[name]["description"].startswith(each.help) for name, each in options.items())
    assert properties["overwrite"]["enum"] == ["never", "missing", "failed", "always"]
    assert (properties["seed"]["default"], properties["seed"]["minimum"]) == (0, 0)
    assert "default" not in properties["jobs"], "the cores of this machine"
    assert properties["jobs"]["description"].endswith("[default: one per core, at most 8]")


TEXTS = ["", "ik", "never", "often", "a,b[c=1,d=2]", "=", "2", "é"]
NUMBERS = [-1, 0, 1, 3, 10**9, 10**10, -0.5, 0.5, 1e8 + 0.5, 1e10 + 0.5]
LISTS = [[], ["ik"], ["ik", ""], ["ik", 1], [0.5], [["ik"]], [True]]
VALUES = [*TEXTS, *NUMBERS, *LISTS, True, False, {"ik": 1}, {}]


def test_what_the_schema_takes_is_what_the_reader_takes(tmp_path):
    """Every option, and words that are none, with every value, beside an option that is right."""
    validator = pytest.importorskip("jsonschema").Draft202012Validator(json.loads(schema()))
    file = tmp_path / "suite.toml"
    taken = 0
    for name in (*declared(RunOptions), "stage", "split", "suite"):
        for value in VALUES:
            file.write_text(f"{name} = {toml(value)}\n" + "limit = 1\n" * (name != "limit"), "utf-8")
            try:
                read_suite(file)
            except FileError:
                assert not validator.is_valid({"limit": 1, name: value}), (name, value)
            else:
                assert validator.is_valid({"limit": 1, name: value}), (name, value)
                taken += 1
    assert taken > 100


def toml(value):
    """As JSON, but for the sign within tables."""
    return json.dumps(value, ensure_ascii=False).replace(":", " =")


def test_the_schema_is_one_of_its_draft_and_takes_a_little_more():
    """Which no keyword of the schema says: texts that name nothing, and 2.0 as a whole number."""
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(json.loads(schema()))
    validator = jsonschema.Draft202012Validator(json.loads(schema()))
    assert validator.is_valid({"methods": ",", "jobs": 2.0})
