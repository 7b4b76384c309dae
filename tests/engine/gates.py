"""What tests of the gate measure with: our golden rows, and our metrics on the frozen motions."""

from dataclasses import replace

from retarget_bench.verification.gate import core, frozen, golden, run

FOLDER = golden.built_in()


def quiet(done, total):
    pass


def metrics():
    missing = []
    built = run.built_metrics(run.own_metrics(), missing)
    assert not missing
    return built


def measured(ours, folder=FOLDER, built=None):
    """What metrics say of the frozen motions now, as a snapshot with nothing else in it; with the frozen
    inputs where no metrics are named."""
    whole, built = built is None, metrics() if built is None else built
    found = replace(
        ours,
        metrics={each.card.name: each.card.version for each in built},
        values=run.value_facts(built),
        frozen={},
        failures={},
        methods={},
    )
    frozen.measure(found, folder, built, quiet)
    if whole:
        core.measure(found, folder)
    return found


def only(ours, names):
    """The golden rows of some metrics on frozen motions, or of some parts on frozen inputs."""
    kept = {value for value, facts in ours.values.items() if facts["metric"] in names}
    rows = {
        row: {column: number for column, number in columns.items() if column.split("@")[0] in kept}
        for row, columns in ours.frozen.items()
    }
    return replace(ours, frozen={row: columns for row, columns in rows.items() if columns})
