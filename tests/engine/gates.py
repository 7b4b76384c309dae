"""What tests of the gate measure with: our golden rows, and our metrics on the frozen motions."""

from retarget_bench.verification.gate import core, frozen, golden, run
from retarget_bench.verification.gate.golden import CLOUDS, MOTION, Measured

FOLDER = golden.built_in()


def quiet(done, total):
    pass


def metrics():
    measurements = Measured(FOLDER)
    built = run.built_metrics(run.own_metrics(), measurements)
    assert not measurements.missing
    return built


def kept(golden_facts, test):
    """The golden facts that pass a test, and no method."""
    facts = {name: text for name, text in golden_facts.facts.items() if test(*golden.parsed(name))}
    return Measured(
        golden_facts.rows, {name: text for name, text in facts.items() if not name.startswith("weights/")}
    )


def measured(golden_facts, built=None, folder=FOLDER):
    """Our golden facts, but those of these metrics (none named: of all, and of the core) measured now."""
    complete, built = built is None, metrics() if built is None else built
    names = {value.id for metric in built for value in metric.card.values}
    names |= {f"{metric.card.name}.features" for metric in built}

    def of_others(part, row, value):
        of_metric = part in (MOTION, CLOUDS)
        return not (of_metric and value in names) and not (complete and (of_metric or part in core.PARTS))

    measurements = kept(golden_facts, of_others)
    for metric in built:
        run.declare(measurements, metric)
    frozen.measure(measurements, folder, built, quiet)
    if complete:
        core.measure(measurements, folder)
    return measurements


def part_measured(golden_facts, part):
    """Our golden facts, but those of one part of the core measured now."""
    measurements = kept(golden_facts, lambda own, row, value: own != part)
    for row, fact in core.PARTS[part](FOLDER):
        measurements.add(f"{part}/{row}", fact)
    return measurements
