"""What tests of the gate measure with: our golden rows, and our metrics on the frozen motions."""

from retarget_bench.verification.gate import core, frozen, golden, run
from retarget_bench.verification.gate.golden import CLOUDS, MOTION, Measured

FOLDER = golden.built_in()


def quiet(done, total):
    pass


def metrics():
    found = Measured(FOLDER)
    built = run.built_metrics(run.own_metrics(), found)
    assert not found.missing
    return built


def kept(ours, test):
    """The golden facts that pass a test, and no method."""
    facts = {name: text for name, text in ours.facts.items() if test(*golden.parsed(name))}
    return Measured(
        ours.rows, {name: text for name, text in facts.items() if not name.startswith("weights/")}
    )


def measured(ours, built=None, folder=FOLDER):
    """Our golden facts, but those of these metrics (none named: of all, and of the core) measured now."""
    whole, built = built is None, metrics() if built is None else built
    names = {value.id for metric in built for value in metric.card.values}
    names |= {f"{metric.card.name}.features" for metric in built}

    def of_others(part, row, value):
        of_metric = part in (MOTION, CLOUDS)
        return not (of_metric and value in names) and not (whole and (of_metric or part in core.PARTS))

    found = kept(ours, of_others)
    for metric in built:
        run.declare(found, metric)
    frozen.measure(found, folder, built, quiet)
    if whole:
        core.measure(found, folder)
    return found


def part_measured(ours, part):
    """Our golden facts, but those of one part of the core measured now."""
    found = kept(ours, lambda own, row, value: own != part)
    for row, said in core.PARTS[part](FOLDER):
        found.add(f"{part}/{row}", said)
    return found
