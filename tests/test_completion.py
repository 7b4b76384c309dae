"""Completion in a real bash, by both names of the command."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from retarget_bench import cli
from retarget_bench.plugins import registry

ROOT = Path(__file__).parents[1]
HEAVY = {"torch", "pandas", "scipy", "matplotlib", "pydantic"}
BASH = shutil.which("bash")
pytestmark = pytest.mark.skipif(BASH is None or os.name != "posix", reason="needs bash")
ASK = """
compopt() { echo "by $*"; }
COMP_WORDS=(%s)
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
COMPREPLY=()
%s %s
printf '%%s\\n' "${COMPREPLY[@]}"
echo --
"""


def completed(folder: Path, script: str, *lines: str) -> list[list[str]]:
    """What a bash that has evaluated the printed script offers behind each line, or by what it goes."""
    file = folder / script
    file.write_text(f"#!{sys.executable}\nfrom retarget_bench.cli import main\n\nmain()\n")
    file.chmod(0o755)
    function = f"_{script.replace('-', '_')}"
    text = f'eval "$({function.upper()}_COMPLETE=bash_source {script})"\n'
    text += f"complete -p {script} > registered\n"
    for line in lines:
        words = [script, *shlex.split(line), *([""] if line.endswith(" ") or not line else [])]
        text += ASK % (shlex.join(words), f"{function}_completion", script)
    environment = {"PATH": f"{folder}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT), "HOME": str(folder)}
    done = subprocess.run(
        [str(BASH), "--norc", "--noprofile", "-c", text],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == "", "a terminal would show it in the line that is being typed"
    assert (folder / "registered").read_text().split()[-1] == script
    return [part.split() for part in done.stdout.split("--\n")[:-1]]


def test_commands_options_choices_and_plug_ins_are_offered(tmp_path):
    commands, options, choices, metrics, posts, folders, pages, _ = completed(
        tmp_path,
        "bench",
        "",
        "run --over",
        "run --overwrite ",
        "run ik --metrics fid",
        "run ik -d puppets nkn+foot",
        "run --out ",
        "info su",
        "rnu --",  # no command: nothing is said in the line being typed
    )
    assert commands == list(cli.COMMANDS)
    assert options == ["--overwrite"]
    assert choices == ["never", "missing", "failed", "always"]
    assert metrics == [each.name for each in registry.names("metrics") if each.name.startswith("fid")]
    assert posts == ["nkn+footfix", "nkn+footlock"]
    assert folders == ["by", "-o", "dirnames"]
    assert pages == ["suite"]


def test_the_other_name_of_the_command_is_completed_too(tmp_path):
    commands, files = completed(tmp_path, "retarget-bench", "re", "doctor wal")
    assert commands == [name for name in cli.COMMANDS if name.startswith("re")]
    assert files == ["by", "-o", "default"]


def test_it_is_said_where_commands_are_listed(bench):
    assert 'eval "$(_BENCH_COMPLETE=bash_source bench)"' in bench("--help").out


@pytest.mark.parametrize("words", ["bench ", "bench run ", "bench table -m ", "bench render --view "])
def test_it_imports_nothing_heavy_and_no_plug_in(words):
    code = (
        "import atexit, json, sys\n"
        "from retarget_bench.cli import main\n"
        "atexit.register(lambda: print(json.dumps(sorted(sys.modules)), file=sys.stderr))\n"
        "main()\n"
    )
    asked = {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split())), "_BENCH_COMPLETE": "bash_complete"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=os.environ | asked, capture_output=True, text=True
    )
    assert done.stdout.startswith("plain,")
    loaded = set(json.loads(done.stderr))
    assert not loaded & HEAVY
    assert not {name for name in loaded if name.startswith("retarget_bench.methods.")}
