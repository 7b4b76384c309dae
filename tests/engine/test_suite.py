"""Suite files: the same words as flags, every mistake at once, flags win."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from retarget_bench.commands.run import command
from retarget_bench.errors import FileError
from retarget_bench.plugins import suite

pytestmark = pytest.mark.usefixtures("in_process")

TOYS = Path(__file__).parent / "toys"


def test_the_same_words_as_the_command_line(tmp_path):
    file = tmp_path / "suite.toml"
    file.write_text('methods = "ik"\ndataset = "mixamo[fps=60]"\nroot = "x"\nsplit = ["intra"]\njobs = 2\n')
    assert suite.read(file) == {
        "methods": ["ik"], "dataset": "mixamo[fps=60]", "root": "x", "split": ["intra"], "jobs": 2,
    }  # fmt: skip


@pytest.mark.parametrize("word", ["overwrite", "redo"])
def test_the_former_word_for_overwriting_is_accepted(tmp_path, word):
    file = tmp_path / "suite.toml"
    file.write_text(f'{word} = "always"\n')
    assert suite.read(file) == {"overwrite": "always"}
    command_line = CliRunner().invoke(command, [f"--{word}", "sometimes"])
    assert "'sometimes' is not one of 'never', 'missing', 'failed', 'always'" in command_line.output


def test_every_mistake_is_listed_with_its_place(tmp_path):
    file = tmp_path / "suite.toml"
    file.write_text('jobs = "two"\nsplits = ["intra"]\nmethods = ["a", 3]\nredo = "often"\n')
    with pytest.raises(FileError) as caught:
        suite.read(file)
    for words in ("jobs:", "splits:", "methods.1:", "redo:", "it may set methods, dataset"):
        assert words in str(caught.value)


@pytest.mark.parametrize("text", ["methods = [", "a = 1\na = 2\n", b"\xff\xfe"])
def test_what_is_not_toml_is_refused(tmp_path, text):
    file = tmp_path / "suite.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(FileError, match="not TOML"):
        suite.read(file)


def test_flags_win(tmp_path):
    file = tmp_path / "suite.toml"
    plugins = [str(path) for path in sorted(TOYS.glob("*.py"))]
    file.write_text(
        f'methods = ["toy_method"]\ndataset = "toy_cases[clips=1]"\nsplit = "intra"\n'
        f'metrics = ["position"]\nplugin = {plugins}\nout = "{tmp_path}/from_suite"\njobs = 1\n'
    )
    from_suite = CliRunner().invoke(command, ["--suite", str(file)], catch_exceptions=False)
    assert from_suite.exit_code == 0
    assert "intra: 2 cases of 1 clip" in from_suite.output
    line = ["toy_method[does=picky]", "--suite", str(file), "--out", f"{tmp_path}/from_flags"]
    from_flags = CliRunner().invoke(command, line, catch_exceptions=False)
    assert "toy_method[does=picky]" in from_flags.output
    assert "1/2" in from_flags.output
    assert not list((tmp_path / "from_suite").rglob("*picky*"))
