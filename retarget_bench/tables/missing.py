"""Why a cell of a table has no number: one of four kinds, and the reason as a sentence."""

from __future__ import annotations

from retarget_bench.analysis.summary import MethodSummary
from retarget_bench.results.compatibility import Newest, metric_versions
from retarget_bench.results.header import DeclaredValue
from retarget_bench.tables.model import FAILED, NOT_APPLICABLE, NOT_RUN, OTHER_VERSION

Gap = tuple[str, str]
"""Kind and reason; the reason is "" where the row's own mark says it."""


def of_row(score: MethodSummary, newest: Newest) -> Gap | None:
    """The kind of a row without any number, or None where values must be looked at one by one."""
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


def of_value(score: MethodSummary, value: str, facts: DeclaredValue, newest: Newest) -> Gap:
    """Why a method that answered has no number for a value, which ``facts`` declare."""
    if stale := newest.stale_value(score.header, value):
        return OTHER_VERSION, stale
    metric = facts.metric
    computed = metric_versions(score.header)
    if metric and computed and metric not in computed:
        return NOT_RUN, f"scored without the metric {metric}; bench score adds it"
    if value not in score.header.values:
        return NOT_RUN, "scored before this value was there; bench score adds it"
    if facts.with_self and score.header.split == "intra":
        return NOT_RUN, "counts self pairs as intra, and there are no results on the self split"
    if refused := score.header.not_applicable.get(value):
        return NOT_APPLICABLE, str(refused["reason"])
    return NOT_APPLICABLE, lacking([facts], score)


def lacking(values: list[DeclaredValue], *scores: MethodSummary) -> str:
    """What values need and these rows lack: their needs, less those that other numbers show are met."""
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
        return "undefined on all of these cases"
    return f"needs {' and '.join(unmet)}, which these cases or predictions lack"
