"""What tests of the gate measure with: our golden rows, and our metrics on the frozen motions."""

from dataclasses import replace

from retarget_bench.verification.gate import frozen, golden, snapshot

FOLDER = golden.built_in()


def quiet(done, total):
    pass


def metrics():
    missing = []
    built = snapshot._metrics(snapshot.own_metrics(), missing)
    assert not missing
    return built


def measured(ours, folder=FOLDER, built=None):
    """What metrics say of the frozen motions now, as a snapshot with nothing else in it."""
    built = metrics() if built is None else built
    found = frozen.measure(folder, built, quiet)
    return replace(
        ours,
        metrics={each.card.name: each.card.version for each in built},
        values=snapshot._value_facts(built) | snapshot._feature_facts(built, found.networks),
        motions=frozen.hashes(folder),
        frozen=found.table,
        failures=found.failures,
        methods={},
    )
