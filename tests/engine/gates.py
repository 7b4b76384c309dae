"""What tests of the gate measure with: our golden rows, and our metrics on the frozen motions."""

from dataclasses import replace

from retarget_bench.verification.gate import frozen, golden, run

FOLDER = golden.built_in()


def quiet(done, total):
    pass


def metrics():
    missing = []
    built = run.built_metrics(run.own_metrics(), missing)
    assert not missing
    return built


def measured(ours, folder=FOLDER, built=None):
    """What metrics say of the frozen motions now, as a snapshot with nothing else in it."""
    built = metrics() if built is None else built
    found = replace(
        ours,
        metrics={each.card.name: each.card.version for each in built},
        values=run.value_facts(built),
        frozen={},
        failures={},
        methods={},
    )
    frozen.measure(found, folder, built, quiet)
    return found
