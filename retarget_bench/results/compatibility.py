"""Results that may share a table: those of the newest data, with every metric in its newest version.

A metric's version is that of its card, which moves when any of its numbers does. Other code under the same
version should give the same numbers, and is mentioned in a note.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from retarget_bench.results.header import ResultHeader


@dataclass(frozen=True)
class Newest:
    """The content of the newest results on a data set, and the newest version of each metric.

    metric_of: value id -> metric; headers of earlier versions did not say it.
    """

    content: str
    metrics: Mapping[str, str]
    metric_of: Mapping[str, str]

    def why_outdated(self, header: ResultHeader) -> str:
        """Why no number of a result may be shown here; "" where its data are the newest."""
        content = header.dataset.content
        if content == self.content:
            return ""
        return (
            f"made on other data under the same name ({content}) than the newest results here "
            f"({self.content}); run the method again"
        )

    def why_value_outdated(self, header: ResultHeader, value: str) -> str:
        """Why a value of a result may not be shown here; "" where its metric is the newest."""
        metric = self.metric_of.get(value, "")
        if metric not in (had := metric_versions(header)) or had[metric] == self.metrics[metric]:
            return ""
        return (
            f"scored by {metric} {had[metric]}, and the newest results here by {metric} "
            f"{self.metrics[metric]}; bench run brings it up to date"
        )


def newest(headers: Iterable[ResultHeader]) -> Newest:
    """The newest of results on one data set: by date, and where dates are equal by version."""
    ordered = sorted(headers, key=lambda header: header.date)
    metrics: dict[str, tuple[str, str]] = {}
    metric_of: dict[str, str] = {}
    for header in ordered:
        for metric, version in metric_versions(header).items():
            metrics[metric] = max(metrics.get(metric, ("", "")), (header.date, version))
        metric_of |= {key: value.metric for key, value in header.declared.items() if value.metric}
    versions = {metric: version for metric, (_, version) in metrics.items()}
    return Newest(ordered[-1].dataset.content, versions, metric_of)


def metric_versions(header: ResultHeader) -> dict[str, str]:
    """Metric -> the version that its card declared, without the hash of its code."""
    return {name: version.split("+")[0] for name, version in header.metrics.items()}


def other_code(headers: Sequence[ResultHeader]) -> list[str]:
    """Metrics that scored some of these results by other code under the same version."""
    codes_of: dict[tuple[str, str], set[str]] = {}
    for header in headers:
        for name, version in header.metrics.items():
            declared, _, code = version.partition("+")
            codes_of.setdefault((name, declared), set()).add(code)
    return sorted({name for (name, _), codes in codes_of.items() if len(codes) > 1})
