"""``bench list``: all plug-ins, none of them imported."""

from collections import Counter

import click

from retarget_bench.commands.options import plugin_option
from retarget_bench.plugins import registry

TITLES = {
    "methods": "Methods",
    "metrics": "Metrics",
    "datasets": "Data sets",
    "posts": "Post-processors (METHOD+NAME)",
}


@click.command("list")
@click.argument(
    "kinds", nargs=-1, type=click.Choice(registry.KINDS), metavar=f"[{'|'.join(registry.KINDS)}]..."
)
@plugin_option
def command(kinds: tuple[registry.Kind, ...]) -> None:
    """List methods, metrics, data sets and post-processors: built in, installed, or of --plugin."""
    for kind in kinds or registry.KINDS:
        click.echo(section(kind))


def section(kind: registry.Kind) -> str:
    """A heading and a line per plug-in: name, summary, and where it comes from if not built in."""
    entries = registry.names(kind)
    times = Counter(entry.name for entry in entries)
    width = max((len(entry.name) for entry in entries), default=0)
    lines = [TITLES[kind]]
    for entry in entries:
        origin = f"  [{entry.origin}]" if entry.origin != registry.BUILT_IN else ""
        clash = "  (not usable: two have this name)" if times[entry.name] > 1 else ""
        lines.append(f"  {entry.name:<{width}}  {entry.summary}{origin}{clash}".rstrip())
    return "\n".join([*lines, *(["  none"] if not entries else []), ""])
