"""Factors between position protocols, measured on the same predictions.

A protocol is a value that declares the facts of ``protocols.PROTOCOL``. Two protocols differ in some of
them; the factor between the two is measured per case.
"""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.protocols import PROTOCOL
from retarget_bench.errors import BenchError
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix

CONSTANT = 1e-6
"""Relative spread of a factor below which it is the same in every case."""
FIRST = "mpjpe_h.world"
"""The protocol that the others are compared with, if the results have it."""
NOTHING = 1e-9
"""Errors below this share of a value's typical size are left out of factors."""


@dataclass(frozen=True)
class ProtocolReading:
    """One protocol's number for a method on a split.

    value: mean over clips of the mean per clip. numbers: ``(cases,)``, nan where a case has none.
    facts: the declared facts of the protocol, and its ``unit``.
    """

    id: str
    value: float
    numbers: np.ndarray
    facts: Mapping[str, str]

    @property
    def there(self) -> np.ndarray:
        """``(cases,)`` bool: those that have a number."""
        return ~np.isnan(self.numbers)


@dataclass(frozen=True)
class Factor:
    """From one protocol to another: ``second = factor * first``.

    means:   factor of the two means over the same cases, or where only the self pairs are more. None where
             one of them is 0.
    usual:   median over cases. low, high: of nine cases in ten. n: cases in which both are above 0.
    reasons: the differences between the protocols: ``error: distance against squared distance`` and so on.
    """

    first: str
    second: str
    means: float | None
    usual: float | None
    low: float
    high: float
    n: int
    reasons: tuple[str, ...]

    @property
    def constant(self) -> bool:
        """The factor is the same in every case."""
        return self.usual is not None and self.high - self.low <= CONSTANT * abs(self.usual)


@dataclass(frozen=True)
class Explanation:
    """One method on one split of one data set."""

    dataset: str
    split: str
    method: str
    readings: tuple[ProtocolReading, ...]
    factors: tuple[Factor, ...]


def explain(matrix: ResultMatrix, row: MethodRow, seed: int = 0) -> Explanation:
    """Values of one method on one split under every position protocol, and the factors between them.

    seed: the place of one among those that the method ran with. Raises BenchError where the results declare
    no protocol or have no number of any.
    """
    label = row.label
    protocols = {key: value for key, value in row.header.values.items() if value.protocol}
    if not protocols:
        raise BenchError(
            f"the results of {label} declare no position protocols (they are old, or have no position "
            "metrics); score them again: bench run"
        )
    readings = []
    for key, value in protocols.items():
        numbers = row.runs[seed].get((key, ""))
        if numbers is not None and not np.isnan(numbers).all():
            mean = float(np.nanmean(statistics.per_clip(numbers, matrix.clips)))
            readings.append(ProtocolReading(key, mean, numbers, {**value.protocol, "unit": value.unit}))
    if not readings:
        raise BenchError(f"{label} has no position error on {matrix.split}: no case has a reference")
    readings.sort(key=lambda reading: reading.id != FIRST)
    if row.header.method.stochastic and row.header.seeds:
        label += f", seed {row.header.seeds[seed]}"
    factors = tuple(_factor(a, b) for a, b in combinations(readings, 2))
    return Explanation(matrix.dataset, matrix.split, label, tuple(readings), factors)


def _factor(first: ProtocolReading, second: ProtocolReading) -> Factor:
    both = first.there & second.there
    same = bool((first.there == second.there).all())
    comparable = same or first.facts["self pairs"] != second.facts["self pairs"]
    pairs = np.array([first.numbers[both], second.numbers[both]])
    typical = np.abs(pairs).sum(axis=1, keepdims=True) / max(1, both.sum())
    one, two = pairs[:, (pairs > NOTHING * typical).all(axis=0)]
    ratios = two / one
    low, usual, high = np.quantile(ratios, [0.05, 0.5, 0.95]) if len(ratios) else (0.0, None, 0.0)
    return Factor(
        first=first.id,
        second=second.id,
        means=second.value / first.value if comparable and first.value > 0 and second.value > 0 else None,
        usual=None if usual is None else float(usual),
        low=float(low),
        high=float(high),
        n=len(ratios),
        reasons=tuple(
            f"{key}: {first.facts.get(key, 'not said')} against {second.facts.get(key, 'not said')}"
            for key in (*PROTOCOL, "unit")
            if first.facts.get(key) != second.facts.get(key)
        ),
    )


# ------------------------------------------------------------------------------------- as text
def factor_text(factor: Factor) -> str:
    """``x 3 in every case``, ``x 0.41 (0.38 to 0.55 in nine cases of ten)``, or why there is none."""
    if factor.usual is None:
        return "no factor: one of the two is 0 in every case"
    if factor.constant:
        text = f"x {factor.usual:.4g} in every case"
    else:
        text = f"x {factor.usual:.4g} ({factor.low:.4g} to {factor.high:.4g} in nine cases of ten)"
    if factor.means is not None and not np.isclose(factor.means, factor.usual, rtol=0.01):
        text += f"; of the means x {factor.means:.4g}"
    return text


def text(explanation: Explanation, factors: Sequence[Factor], columns: int = 100) -> str:
    """For a terminal of so many columns: every protocol's number with what fixes it, then the factors asked
    for."""
    wrap = partial(textwrap.wrap, width=columns, break_on_hyphens=False)
    out = [f"{explanation.method} on {explanation.dataset}, {explanation.split}", ""]
    ids = max(len(reading.id) for reading in explanation.readings)
    numbers = [f"{reading.value:.4g} {reading.facts['unit']}" for reading in explanation.readings]
    width = max(map(len, numbers))
    for reading, number in zip(explanation.readings, numbers, strict=True):
        fixed = "; ".join(reading.facts[key] for key in PROTOCOL if key in reading.facts)
        lead = f"  {reading.id:<{ids}}  {number:>{width}}  n {reading.there.sum()}  "
        out += wrap(fixed, initial_indent=lead, subsequent_indent=" " * (ids + 4))
    out += ["", f"  ({'; '.join(PROTOCOL)})", ""]
    for factor in factors:
        line = f"{factor.first} -> {factor.second}: {factor_text(factor)}"
        out += wrap(line, initial_indent="  ", subsequent_indent=" " * 10)
        for reason in factor.reasons:
            out += wrap(reason, initial_indent=" " * 6, subsequent_indent=" " * 10)
    return "\n".join(out) + "\n"


def markdown(explanation: Explanation, factors: Sequence[Factor]) -> str:
    """Two Markdown tables: protocols and factors."""
    out = [f"## {explanation.method} on {explanation.dataset}, {explanation.split}", ""]
    out += ["| protocol | value | unit | n | " + " | ".join(PROTOCOL) + " |"]
    out.append("|---|---:|---|---:|" + "---|" * len(PROTOCOL))
    for reading in explanation.readings:
        number = f"{reading.value:.4g} | {reading.facts['unit']} | {reading.there.sum()}"
        fixed = " | ".join(reading.facts.get(key, "") for key in PROTOCOL)
        out.append(f"| `{reading.id}` | {number} | {fixed} |")
    out += ["", "| from | to | factor | because |", "|---|---|---|---|"]
    for factor in factors:
        because = "; ".join(factor.reasons)
        out.append(f"| `{factor.first}` | `{factor.second}` | {factor_text(factor)} | {because} |")
    return "\n".join(out) + "\n"


def chosen(explanation: Explanation, between: Sequence[str], *, every: bool) -> list[Factor]:
    """The factors to show: between the named protocols, all, or those from the first protocol.

    Raises BenchError for a protocol that there is no number of, and for one alone.
    """
    ids = [reading.id for reading in explanation.readings]
    if unknown := [id_ for id_ in between if id_ not in ids]:
        raise BenchError(
            f"{explanation.method} has no protocol {unknown[0]!r} here; it has {', '.join(ids)}"
        )
    if between:
        if len(set(between)) == 1:
            raise BenchError(f"a factor is between two protocols; name another beside {between[0]}")
        return [f for f in explanation.factors if {f.first, f.second} <= set(between)]
    return [f for f in explanation.factors if every or f.first == ids[0]]
