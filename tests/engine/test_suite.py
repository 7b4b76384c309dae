"""Suite files: the same words as flags, every mistake at once, flags win."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from retarget_bench.commands.run import command, read_suite
from retarget_bench.errors import FileError

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
