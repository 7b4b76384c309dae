"""``bench info``: the card of a plug-in and of its weights, or the page of all protocols."""

import textwrap
from collections.abc import Iterable
from typing import Any

import click

from retarget_bench.commands.options import plugin_names, plugin_option
from retarget_bench.plugins import parameters, registry
from retarget_bench.plugins.spec import Spec

WIDTH = 100
FACTS = (
    # attribute of a card, what it is called
    ("version", "version"),
    ("paper", "paper"),
    ("licence", "licence"),
    ("obtain", "to get it"),
    ("accepts", "takes motions known by"),
    ("needs", "needs (privileged)"),
    ("tasks", "tasks"),
    ("splits", "splits"),
)


@click.command("info")
@click.argument("name", required=False, metavar="[NAME]", shell_complete=plugin_names(*registry.KINDS))
@click.option("--protocols", is_flag=True, help="Every value of every metric, as a page in Markdown.")
@plugin_option
def command(name: str | None, protocols: bool) -> None:
    """Show what a method, metric, data set or post-processor is, its parameters, how values are defined.

    For a learned method also the cards of its shipped weights: data, training config, time, scores. With
    NAME[weights=PATH] that of a file, or of a folder that bench train wrote.
    """
    if protocols:
        from retarget_bench.analysis import protocols as page

        click.echo(page.render(), nl=False)
    elif name is None:
        raise click.UsageError("give a NAME (bench list shows them), or --protocols")
    else:
        spec = Spec.parse(name)
        asked = [(kind, spec.alone) for kind in registry.kinds_of(spec.name)]
        if spec.posts:
            asked = [("methods", spec.alone), *(("posts", post) for post in spec.posts)]
        for kind, each in asked:
            click.echo("\n".join(description(kind, each)) + "\n")


def description(kind: registry.Kind, spec: Spec) -> list[str]:
    """The lines that describe a plug-in. Raises BenchError where it cannot be imported."""
    entry = registry.find(kind, spec.name)
    factory = registry.load(kind, spec.name)
    card = getattr(factory, "card", None) or registry.create(kind, spec).card
    lines = [f"{entry}", *_wrapped(card.summary), ""]
    for attribute, title in FACTS:
        if value := getattr(card, attribute, None):
            text = value if isinstance(value, str) else ", ".join(map(str, value))
            lines += _wrapped(text, f"{title}: ")
    lines += [sentence for attribute, sentence in _marks() if getattr(card, attribute, False)]
    if taken := parameters.describe(factory):
        lines += ["", "Parameters"] + [line for each in taken for line in _wrapped(each, "  ")]
    if reported := getattr(card, "reported", None):
        lines += [
            "",
            "Published numbers",
            *(f"  {where}: {number:g}" for where, number in reported.items()),
        ]
    if kind == "metrics":
        lines += [line for value in card.values for line in _value(value)]
    if text := (factory.__doc__ or "").strip():
        lines += ["", *textwrap.dedent(f"    {text}").splitlines()]
    if hasattr(factory, "shipped"):
        lines += _weights(factory, spec)
    return lines


def _weights(factory: Any, spec: Spec) -> list[str]:
    """The cards of shipped weights; of a spec that names weights, theirs alone."""
    from retarget_bench.training import weights
    from retarget_bench.training.card_text import described

    if asked := spec.parameters.get("weights"):
        places = {str(asked): factory.shipped().get(str(asked)) or weights.locate(str(asked))}
    else:
        places = factory.shipped()
    if not places:
        return ["", f"Weights: none are shipped; bench train {spec.name} makes some"]
    lines = []
    for name, place in places.items():
        lines += ["", f"Weights {name}"]
        card = weights.read_card(place)
        weights.check(place, card, method=spec.name)
        lines += [x for fact in described(card) for x in _wrapped(fact, "  ")]
    return lines


def _marks() -> Iterable[tuple[str, str]]:
    return (
        ("control", "a control: shown in tables, never ranked"),
        ("stochastic", "random: results depend on the seed"),
    )


def _value(value: Any) -> list[str]:
    """A value of a metric: meaning, unit, needs, formula and source."""
    better = f"best at {value.goal:g}" if value.better == "target" else f"{value.better} is better"
    curve = f", one number per {value.index}" if value.index else ""
    facts = [
        f"unit {value.unit}; {better if value.better != 'none' else 'a description, never ranked'}{curve}",
        f"needs {', '.join(value.needs) or 'nothing but the prediction'}",
        f"formula: {value.formula}",
        f"source: {value.source}",
    ]
    return ["", *_wrapped(value.meaning, f"{value.id}: "), *(x for f in facts for x in _wrapped(f, "  "))]


def _wrapped(text: str, start: str = "") -> list[str]:
    rest = " " * (2 + len(start) - len(start.lstrip()))
    return textwrap.wrap(text, WIDTH, initial_indent=start, subsequent_indent=rest, break_on_hyphens=False)
