"""``bench test``: the contract kit over one plug-in."""

import click

from retarget_bench import defaults
from retarget_bench.commands.options import dataset_spec, plugin_names, plugin_option, root_option
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec


@click.command("test")
@click.argument("name", metavar="NAME", shell_complete=plugin_names(*registry.KINDS))
@click.option(
    "-d",
    "--dataset",
    metavar="DATASET",
    help=f"Try a method or metric on this data set. [default: {defaults.DATASET}]",
)
@root_option
@plugin_option
def command(name: str, dataset: str | None, root: str | None) -> int:
    """Check that a plug-in keeps its contract: a line per check, exit status 1 if one fails.

    NAME is a method, metric, data set or post-processor, with parameters in brackets if needed. METHOD+POST
    is checked as a method.
    """
    spec = Spec.parse(name)
    data = dataset_spec(dataset or defaults.DATASET, root if dataset else None)
    failed = 0
    kinds: list[registry.Kind] = ["methods"] if spec.posts else registry.kinds_of(spec.name)
    for kind in kinds:
        failed += _tested(kind, dataset_spec(name, root) if kind == "datasets" else spec, data)
    return int(failed > 0)


def _tested(kind: registry.Kind, spec: Spec, data: Spec) -> int:
    """Print every check of one plug-in; the number of those that failed."""
    from retarget_bench.verification import contract

    click.echo(f"{registry.find(kind, spec.name)}")
    checks = []
    for check in contract.check(kind, spec, data):
        click.echo(f"  {check}")
        checks.append(check)
    failed = sum(not check.passed for check in checks)
    click.echo(f"{failed} of {len(checks)} checks failed" if failed else f"all {len(checks)} checks passed")
    return failed
