"""Commands about plug-ins: ``bench list``, ``info``, ``new`` and ``test``."""

import re
import textwrap
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from retarget_bench.commands import echo
from retarget_bench.commands.options import plugin_names, screen_width, takes
from retarget_bench.errors import BenchError
from retarget_bench.files import write_text
from retarget_bench.options import OptionSet, option
from retarget_bench.plugins import named, parameters, registry
from retarget_bench.plugins.spec import Spec

ANY_PLUGIN = plugin_names(*registry.KINDS)
TITLES = {
    "methods": "Methods",
    "metrics": "Metrics",
    "datasets": "Data sets",
    "posts": "Post-processors (METHOD+NAME)",
}
FACTS = (
    # attribute of a card, what it is called
    ("version", "version"),
    ("paper", "paper"),
    ("licence", "licence"),
    ("authors_weights", "weights of its authors"),
    ("obtain", "to get it"),
    ("accepts", "takes motions known by"),
    ("needs", "needs (privileged)"),
    ("tasks", "tasks"),
    ("splits", "splits"),
)
MARKS = (
    ("control", "a control: shown in tables, never ranked"),
    ("stochastic", "random: results depend on the seed"),
)
PARAMETERS = 6
"""How many are shown of a plug-in that has many."""
TEMPLATES = Path(registry.__file__).parent / "templates"
KINDS: dict[str, registry.Kind] = {kind.removesuffix("s"): kind for kind in registry.KINDS}
_NAME = re.compile(r"[a-z][a-z0-9_]{0,40}")


@click.command("list")
@click.argument(
    "kinds", nargs=-1, type=click.Choice(registry.KINDS), metavar=f"[{'|'.join(registry.KINDS)}]..."
)
def list_plugins(kinds: tuple[registry.Kind, ...]) -> None:
    """List methods, metrics, data sets and post-processors: built in, or installed."""
    for kind in kinds or registry.KINDS:
        echo(section(kind))


def section(kind: registry.Kind) -> str:
    """A heading, and for each plug-in its name, summary, and where it comes from if not built in."""
    entries = registry.names(kind)
    times = Counter(entry.name for entry in entries)
    width = max((len(entry.name) for entry in entries), default=0)
    lines = [TITLES[kind]]
    for entry in entries:
        origin = f"  [{entry.origin}]" if entry.origin != registry.BUILT_IN else ""
        clash = "  (not usable: two have this name)" if times[entry.name] > 1 else ""
        lines += _wrapped(
            f"{entry.summary}{origin}{clash}", f"  {entry.name:<{width}}  ", " " * (width + 4)
        )
    return "\n".join([*lines, *(["  none"] if not entries else []), ""])


class InfoOptions(OptionSet):
    """``bench info``."""

    all: bool = option("All parameters, where there are many.", default=False)


def _described_names(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Shell completion by plug-ins, and by the pages that ``info`` writes."""
    pages = [CompletionItem(page) for page in ("protocols", "suite") if page.startswith(incomplete)]
    named = ANY_PLUGIN(ctx, param, incomplete)
    return [*pages, *(each for each in named if each.type == "plain" or not pages)]


@click.command("info")
@click.argument("name", required=False, metavar="[NAME]", shell_complete=_described_names)
@takes(InfoOptions)
def info(name: str | None, options: InfoOptions) -> None:
    """Show what a method, metric, data set or post-processor is, its parameters, how values are defined.

    NAME may also be a value, by its id, its label or its family (MPJPE, "contact recall"). Case, spaces, _
    and - do not count.

    For a learned method also the cards of its shipped weights: data, training config, time, scores. With
    NAME[weights=PATH] that of a file, or of a folder that bench train wrote. `bench info protocols` writes
    every value of every metric as a page in Markdown, `bench info suite` the JSON schema of suite files.
    """
    if name == "protocols":
        from retarget_bench.analysis import protocols as page

        echo(page.render(), nl=False)
    elif name == "suite":
        from retarget_bench.commands import suite

        echo(suite.schema(), nl=False)
    elif name is None:
        raise BenchError("give a NAME; bench list shows them")
    else:
        for lines in _described(name, options.all):
            echo("\n".join(lines) + "\n")


def _described(name: str, all_: bool) -> list[list[str]]:
    """The lines about what a name stands for: plug-ins, or else values of metrics, by id, label or family.

    Raises BenchError where it stands for nothing.
    """
    from retarget_bench.tables import names

    text, installed = registry.spelled(name), names.installed()
    try:
        spec = named.parse(text)
        kinds = registry.kinds_of(spec.name)
    except BenchError:
        if not (value_ids := names.candidates(name, installed)):
            plugins = [entry.name for kind in registry.KINDS for entry in registry.names(kind)]
            if meant := names.close(name, installed, plugins, cutoff=0.7):
                raise BenchError(
                    f"nothing is called {name!r}; did you mean {' or '.join(meant)}?"
                ) from None
            raise
        return [_value_of(installed[key].metric, key) for key in value_ids]
    parts = [(kind, spec.alone) for kind in kinds]
    if spec.posts:
        parts = [("methods", spec.alone), *(("posts", post) for post in spec.posts)]
    return [description(kind, each, all_) for kind, each in parts]


def _value_of(metric: str, value_id: str) -> list[str]:
    """The lines that describe one value of a metric."""
    card = registry.create("metrics", metric).card
    (value,) = (each for each in card.values if each.id == value_id)
    return [f"{value.label}, value of metric {metric} {card.version}", *_value(value)]


def description(kind: registry.Kind, spec: Spec, all_: bool) -> list[str]:
    """The lines that describe a plug-in. Raises BenchError where it cannot be imported.

    all_: False: its first parameters only, which are those that people change.
    """
    entry = registry.find(kind, spec.name)
    factory = registry.load(kind, spec.name)
    card = _card(kind, spec, factory)
    lines = [f"{entry}", *_wrapped(card.summary), ""]
    for attribute, title in FACTS:
        if value := getattr(card, attribute, None):
            if (kind, attribute) == ("posts", "needs"):
                title = "needs of the method, on the source's own body (twice the time)"
            text = value if isinstance(value, str) else ", ".join(map(str, value))
            lines += _wrapped(text, f"{title}: ")
    lines += [sentence for attribute, sentence in MARKS if getattr(card, attribute, False)]
    if kind == "methods":
        lines += _assets(spec)
        lines += _worse(spec)
    if taken := parameters.describe(factory):
        shown = taken if all_ else taken[:PARAMETERS]
        lines += ["", "Parameters"] + [line for each in shown for line in _wrapped(each, "  ")]
        if more := len(taken) - len(shown):
            lines.append(f"  and {more} more: bench info {spec.name} --all")
    if kind == "metrics":
        lines += [line for value in card.values for line in _value(value)]
    if text := (factory.__doc__ or "").strip():
        lines += ["", *_fitted(textwrap.dedent(f"    {text}"))]
    if hasattr(factory, "shipped"):
        lines += _weights(factory, spec)
    return lines


def _assets(spec: Spec) -> list[str]:
    """The files that a method needs beside its code, each with its hash or what is wrong with it."""
    from retarget_bench.plugins.assets import asset_hash, asset_path

    method = registry.create("methods", spec)
    lines = []
    for name, asset in method.card.assets.items():
        try:
            state = f"sha256 {asset_hash(asset_path(method, name))[:12]}..."
        except BenchError as error:
            state = str(error)
        lines += _wrapped(f"{asset.what} ({name}): {state}", "needs ")
    return lines


def _worse(spec: Spec) -> list[str]:
    """Where shipped results show a method worse than the default one. [] where it cannot be built."""
    from retarget_bench.python import known

    try:
        comparisons = known.worse(spec)
    except BenchError:
        return []
    return [line for each in comparisons for line in _wrapped(each.sentence)]


def _card(kind: registry.Kind, spec: Spec, factory: Any) -> Any:
    """The card with these parameters; the class's where the plug-in cannot be built as it is asked for."""
    try:
        return registry.create(kind, spec).card
    except BenchError:
        if card := parameters.class_card(factory):
            return card
        raise


def _weights(factory: Any, spec: Spec) -> list[str]:
    """The cards of shipped weights; of a spec that names weights, theirs alone."""
    from retarget_bench.training import weights
    from retarget_bench.training.card_text import described
    from retarget_bench.training.learned_method import of_weights

    explicit = spec.parameters.get("weights")
    names = [str(explicit)] if explicit else list(factory.shipped())
    if not names:
        written = named.written(Spec(spec.name), places=False)
        return ["", f"Weights: none are shipped; bench train {written} makes some"]
    lines = []
    for name in names:
        lines += ["", f"Weights {name}"]
        card = factory.card_of(name)
        weights.check(name, card, spec.name)
        share = of_weights(spec.name, name).training_share
        lines += [x for fact in described(card, share) for x in _wrapped(fact, "  ")]
    return lines


def _value(value: Any) -> list[str]:
    """A value of a metric: meaning, unit, needs, formula and source."""
    better = f"best at {value.goal:g}" if value.better == "target" else f"{value.better} is better"
    curve = f", one number per {value.index}" if value.index else ""
    facts = [
        f"unit {value.unit}; {better if value.better != 'none' else 'a description, never ranked'}{curve}",
        f"needs {', '.join(value.needs) or 'nothing but the prediction'}",
        f"formula: {value.formula}",
        *([f"against the source (--against source): {value.source_formula}"] * bool(value.source_formula)),
        f"source: {value.source}",
    ]
    return ["", *_wrapped(value.meaning, f"{value.id}: "), *(x for f in facts for x in _wrapped(f, "  "))]


def _wrapped(text: str, start: str = "", rest: str | None = None) -> list[str]:
    """A text on lines that fit the screen. rest: before all but the first; by default two spaces more than
    ``start`` has."""
    rest = " " * (2 + len(start) - len(start.lstrip())) if rest is None else rest
    wide = screen_width()
    lines = textwrap.wrap(text, wide, initial_indent=start, subsequent_indent=rest, break_on_hyphens=False)
    return lines or [start.rstrip()]


def _fitted(text: str) -> list[str]:
    """The lines of a docstring; paragraphs and entries of lists that are too wide are wrapped anew.

    An entry begins with a hyphen, or behind a sentence's end with a name and a colon, as parameters do.
    """
    fitted = []
    for part in re.split(r"\n(?=[ ]*(?:\n|- ))|(?<=[.:)\n])\n(?=[ ]*[\w`, ]{1,30}: )", text):
        lines = part.splitlines()
        if max(map(len, lines), default=0) > screen_width():
            first, *others = [line for line in lines if line]
            start, rest = map(_indent, [first, *others, "    "][:2])
            fitted += [""] * (not lines[0])
            fitted += _wrapped(" ".join(line.strip() for line in (first, *others)), start, rest)
        else:
            fitted += lines or [""]
    return fitted


def _indent(line: str) -> str:
    return line[: len(line) - len(line.lstrip())]


class NewOptions(OptionSet):
    """``bench new``."""

    package: bool = option("Make a package that can be pip-installed and published.", default=False)
    worker: bool = option("A method whose code runs in another Python, old or new.", default=False)


@click.command("new")
@click.argument("kind", type=click.Choice(list(KINDS)), metavar="|".join(KINDS))
@click.argument("name", metavar="NAME")
@takes(NewOptions)
def new(kind: str, name: str, options: NewOptions) -> None:
    """Start a method, metric, data set or post-processor from a template that already runs.

    Writes NAME.py here; with --package a folder NAME; with --worker also NAME_code.py, which needs numpy
    alone, and NAME_worker.py, which runs it. Nothing that exists is overwritten.
    """
    if options.worker and (options.package or kind != "method"):
        raise BenchError("--worker is for methods, and not for packages")
    if not _NAME.fullmatch(name):
        raise BenchError(
            f"{name!r} is no name for a plug-in: use small letters, digits and _, a letter first"
        )
    if taken := [entry for entry in registry.names(KINDS[kind]) if entry.name == name]:
        raise BenchError(f"{taken[0]} has this name already; choose another one")
    spec, steps = f"{name}.py", [f"bench test {name}.py"]
    if options.package:
        texts = _package(kind, name)
        spec, steps = name, [f"pip install --no-deps -e {name}", f"bench test {name}"]
    elif options.worker:
        texts, steps = _worker(name), []
    else:
        texts = {Path(spec): plugin_source(kind, name)}
    if existing := [path for path in ([Path(name)] if options.package else texts) if path.exists()]:
        raise BenchError(f"{existing[0]} exists already; nothing was written")
    for path, text in texts.items():
        write_text(path, text)
        echo(f"wrote {path}")
    runs = {
        "method": f"bench run {spec} copy_rotations",
        "metric": f"bench run ik --metrics {spec}",
        "post": f"bench run copy_rotations+{spec}",
    }
    steps += [runs[kind]] if kind in runs else []
    echo("Now change what it does, and then:\n" + "\n".join(f"  {step}" for step in steps))


def plugin_source(kind: str, name: str) -> str:
    """The template of a kind with its names replaced: ``my_method`` and ``MyMethod``."""
    class_name = "".join(part.capitalize() for part in name.split("_"))
    return _template(f"{kind}.py", {f"my_{kind}": name, f"My{kind.capitalize()}": class_name})


def _template(file: str, words: Mapping[str, str]) -> str:
    """A template with each of these words replaced."""
    text = (TEMPLATES / file).read_text(encoding="utf-8")
    for word, replacement in words.items():
        text = text.replace(word, replacement)
    return text


def _worker(name: str) -> dict[Path, str]:
    """A method, its code, and the loop by which that code answers in another Python."""
    from retarget_bench.evaluation import prediction

    return {
        Path(f"{name}.py"): plugin_source("worker", name),
        Path(f"{name}_code.py"): plugin_source("worker_code", name),
        Path(f"{name}_worker.py"): Path(prediction.__file__)
        .with_name("numpy_worker.py")
        .read_text(encoding="utf-8"),
    }


def _package(kind: str, name: str) -> dict[Path, str]:
    """The files of a package with one plug-in."""
    words = {
        "my-plugin": name.replace("_", "-"),
        "my_plugin": name,
        "my_kind": KINDS[kind],
        "my_singular": registry.SINGULAR[KINDS[kind]],
        '"methods"': f'"{KINDS[kind]}"',
    }
    code = Path(name) / f"retarget_bench_{name}"
    return {
        Path(name) / "pyproject.toml": _template("package/pyproject.toml", words),
        Path(name) / "README.md": _template("package/README.md", words),
        code / "__init__.py": plugin_source(kind, name),
        code / "assets" / "README.md": _template("package/ASSETS.md", words),
        Path(name) / "tests" / f"test_{name}.py": _template("package/test_plugin.py", words),
    }
