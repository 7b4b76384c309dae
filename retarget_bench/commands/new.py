"""``bench new``: a template of a plug-in that runs as it is."""

import re
from pathlib import Path

import click

from retarget_bench.errors import BenchError
from retarget_bench.files import write_text
from retarget_bench.plugins import registry

TEMPLATES = Path(registry.__file__).parent / "templates"
KINDS: dict[str, registry.Kind] = {
    "method": "methods",
    "metric": "metrics",
    "dataset": "datasets",
    "post": "posts",
}
_NAME = re.compile(r"[a-z][a-z0-9_]{0,40}")


@click.command("new")
@click.argument("kind", type=click.Choice(list(KINDS)), metavar="|".join(KINDS))
@click.argument("name", metavar="NAME")
@click.option("--package", is_flag=True, help="Make a package that can be pip-installed and published.")
def command(kind: str, name: str, package: bool) -> None:
    """Start a method, metric, data set or post-processor from a template that already runs.

    Writes NAME.py here; with --package a folder NAME. Nothing that exists is overwritten.
    """
    if not _NAME.fullmatch(name):
        raise BenchError(
            f"{name!r} is no name for a plug-in: use small letters, digits and _, a letter first"
        )
    if taken := [entry for entry in registry.names(KINDS[kind]) if entry.name == name]:
        raise BenchError(f"{taken[0]} has this name already; choose another one")
    if package:
        _write_package(kind, name)
        steps = [f"pip install -e {name}", f"bench test {name}"]
    else:
        _write_all({Path(f"{name}.py"): plugin_source(kind, name)})
        steps = [f"bench test {name} --plugin {name}.py"]
    if kind == "method":
        steps.append(f"bench run {name} copy_rotations" + ("" if package else f" --plugin {name}.py"))
    if kind == "post":
        steps.append(f"bench run copy_rotations+{name}" + ("" if package else f" --plugin {name}.py"))
    click.echo("Now change what it does, and then:\n" + "\n".join(f"  {step}" for step in steps))


def plugin_source(kind: str, name: str) -> str:
    """The template of a kind with its names replaced: ``my_method`` and ``MyMethod``."""
    text = (TEMPLATES / f"{kind}.py").read_text(encoding="utf-8")
    class_name = "".join(part.capitalize() for part in name.split("_"))
    return text.replace(f"my_{kind}", name).replace(f"My{kind.capitalize()}", class_name)


def _write_package(kind: str, name: str) -> None:
    words = {
        "my-plugin": name.replace("_", "-"),
        "my_plugin": name,
        "my_kind": KINDS[kind],
        "my_singular": registry.SINGULAR[KINDS[kind]],
        '"methods"': f'"{KINDS[kind]}"',
    }

    def filled(template: str) -> str:
        text = (TEMPLATES / "package" / template).read_text(encoding="utf-8")
        for word, meant in words.items():
            text = text.replace(word, meant)
        return text

    folder = Path(name)
    if folder.exists():
        raise BenchError(f"{folder} exists already; nothing was written")
    _write_all(
        {
            folder / "pyproject.toml": filled("pyproject.toml"),
            folder / "README.md": filled("README.md"),
            folder / f"retarget_bench_{name}" / "__init__.py": plugin_source(kind, name),
            folder / "tests" / f"test_{name}.py": filled("test_plugin.py"),
        }
    )


def _write_all(texts: dict[Path, str]) -> None:
    """Write new files, or none if one is there already."""
    if existing := [path for path in texts if path.exists()]:
        raise BenchError(f"{existing[0]} exists already; nothing was written")
    for path, text in texts.items():
        write_text(path, text)
        click.echo(f"wrote {path}")
