"""Missing values: the kind of an empty cell, and the reason as a sentence."""

from retarget_bench.analysis.summary import MethodSummary
from retarget_bench.results.compatibility import Newest, metric_versions
from retarget_bench.results.header import DeclaredValue
from retarget_bench.tables.model import FAILED, NOT_APPLICABLE, NOT_RUN, OTHER_VERSION

NEEDS = {"touches": "self-contact labels", "contacts": "contact labels"}
"""Needs of values in words, where their ids do not say it."""

MissingValue = tuple[str, str]
"""Kind (see ``model.EMPTY``) and reason; the reason is "" where the mark of the row gives it."""


def of_row(score: MethodSummary, newest: Newest) -> MissingValue | None:
    """The kind of all cells of a row without any number; None where some cells have one."""
    if newest.stale_data(score.header):
        return OTHER_VERSION, ""
    counts = score.header.counts
    if score.ok or score.means:
        return None
    if not counts.asked:
        return NOT_RUN, ""
    if counts.failed + counts.invalid:
        return FAILED, ""
    return (NOT_RUN, "") if counts.missing else (NOT_APPLICABLE, "")


def of_value(score: MethodSummary, value: str, facts: DeclaredValue, newest: Newest) -> MissingValue:
    """Why a method with answers has no number for a value. facts: the declaration of the value."""
    if stale := newest.stale_value(score.header, value):
        return OTHER_VERSION, stale
    metric = facts.metric
    computed = metric_versions(score.header)
    if metric and computed and metric not in computed:
        return NOT_RUN, f"scored without the metric {metric}; bench score adds it"
    if value not in score.header.values:
        return NOT_RUN, "scored before this value existed; bench score adds it"
    if facts.with_self and score.header.split == "intra":
        return NOT_RUN, "pools self pairs with intra, and there are no results on the self split"
    if refused := score.header.not_applicable.get(value):
        return NOT_APPLICABLE, str(refused["reason"])
    return NOT_APPLICABLE, lacking([facts], score)


def lacking(values: list[DeclaredValue], *scores: MethodSummary) -> str:
    """The needs of values that no number of these rows shows to be met, as text."""
    met = {
        need
        for score in scores
        for key in score.means
        if key in score.header.values
        for need in score.header.values[key].needs
    }
    needs = dict.fromkeys(need for value in values for need in value.needs)
    unmet = [need for need in needs if need not in met]
    if not unmet:
        return "undefined for all of these cases"
    return f"needs {' and '.join(NEEDS.get(need, need) for need in unmet)}"
