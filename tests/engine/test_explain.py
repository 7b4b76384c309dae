"""Protocols beside each other: factors worked out by hand, and those that must be exact."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from stored import header

from retarget_bench.analysis import protocol_factors
from retarget_bench.analysis.protocols import PROTOCOL
from retarget_bench.api import CaseInfo, MetricCard
from retarget_bench.cli import main
from retarget_bench.errors import BenchError
from retarget_bench.plugins.registry import create
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import result_matrix, store
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.store import CaseResult, ResultPaths
from tests.in_process import without_processes

FACTS = {
    "error": "distance",
    "divided by": "h",
    "joints": "native",
    "placed": "world",
    "frames": "all",
    "self pairs": "apart",
}
BUILT_IN = ("position", "papers", "nkn", "procrustes")


def declared(unit: str = "1", *, with_self: bool = False, **facts: str) -> DeclaredValue:
    return DeclaredValue(
        label="x", unit=unit, better="lower", goal=1.0, index="", meaning="", tolerance=0.0,
        with_self=with_self, protocol={**FACTS, **facts},
    )  # fmt: skip


VALUES = {
    "metres": declared("m", **{"divided by": "1"}),
    "mpjpe_h.world": declared("% of height"),
    "centimetres": declared("cm", **{"divided by": "1"}),
    "squared": declared("m", error="squared distance", **{"divided by": "1"}),
    "pooled": declared("m", with_self=True, **{"divided by": "1", "self pairs": "in intra"}),
    "elsewhere": replace(declared(), protocol={}),
}


def results(
    root: Path, split: str, numbers: dict[tuple[str, str], float], height: float = 2.0, **changes: object
) -> None:
    """Results of one method whose error in metres is given for every (pair, clip)."""
    infos, entries = [], []
    for (pair, clip), metres in numbers.items():
        source, target = pair.split(">")
        info = CaseInfo(f"data/{pair}/{clip}", "retarget", split, source, target, clip, "", 10)
        infos.append(info)
        values = {
            "metres": metres,
            "mpjpe_h.world": 100 * metres / height,
            "centimetres": 100 * metres,
            "squared": metres**2,
            "pooled": metres,
            "elsewhere": 1.0,
        }
        entries.append(CaseResult(info.id, "ok", values=values))
    place = ResultPaths(root, "data", "retarget", split, "mine")
    described = replace(header("mine", entries, split), **{"values": VALUES, **changes})
    store.write_results(place, described, entries, infos)


def explained(root: Path) -> protocol_factors.Explanation:
    """The last split of the results in a folder: intra, of self and intra."""
    *_, matrix = result_matrix.result_matrices(store.find_results(root))
    return protocol_factors.explain(matrix, matrix.rows[0])


INTRA = {("a>b", "x"): 0.1, ("b>a", "x"): 0.3, ("a>b", "y"): 0.4}


def factor(explanation: protocol_factors.Explanation, first: str, second: str) -> protocol_factors.Factor:
    return next(f for f in explanation.factors if (f.first, f.second) == (first, second))


def test_factors_by_hand(tmp_path: Path) -> None:
    results(tmp_path, "intra", INTRA)
    explanation = explained(tmp_path)
    assert explanation.readings[0].id == "mpjpe_h.world"
    assert "elsewhere" not in [reading.id for reading in explanation.readings]
    metres = next(reading for reading in explanation.readings if reading.id == "metres")
    assert metres.value == pytest.approx((0.2 + 0.4) / 2)  # clip x: two pairs, clip y: one
    exact = factor(explanation, "metres", "centimetres")
    assert exact.constant
    assert exact.usual == pytest.approx(100.0)
    assert exact.reasons == ("unit: m against cm",)
    square = factor(explanation, "metres", "squared")
    assert not square.constant
    assert square.usual == pytest.approx(0.3)  # the median of the distances themselves
    assert (square.low, square.high) == pytest.approx(tuple(np.quantile([0.1, 0.3, 0.4], [0.05, 0.95])))
    assert square.means == pytest.approx(((0.01 + 0.09) / 2 + 0.16) / 2 / 0.3)
    assert square.reasons == ("error: distance against squared distance",)
    assert len(explanation.factors) == 6  # each pair of four protocols; the fifth needs self pairs


def test_self_pairs_move_the_mean_and_no_case(tmp_path: Path) -> None:
    selves = {("a>a", "x"): 0.0, ("b>b", "y"): 0.0}
    for split, numbers in (("intra", INTRA), ("self", selves)):
        results(tmp_path / "both", split, numbers)
    explanation = explained(tmp_path / "both")
    pooled = factor(explanation, "metres", "pooled")
    assert pooled.constant
    assert pooled.usual == pytest.approx(1.0)
    assert pooled.means == pytest.approx(((0.4 / 3) + 0.2) / 2 / 0.3)
    assert pooled.reasons == ("self pairs: apart against in intra",)
    results(tmp_path / "alone", "self", selves)
    alone = explained(tmp_path / "alone")
    assert all(f.usual is None for f in alone.factors)
    assert "is 0 in every case" in protocol_factors.text(alone, alone.factors)


def test_between_all_and_unknown_protocols(tmp_path: Path) -> None:
    results(tmp_path, "intra", INTRA)
    explanation = explained(tmp_path)
    first = protocol_factors.chosen(explanation, (), every=False)
    assert {f.first for f in first} == {"mpjpe_h.world"}
    assert len(first) == 3
    assert len(protocol_factors.chosen(explanation, (), every=True)) == 6
    (one,) = protocol_factors.chosen(explanation, ("squared", "metres"), every=False)
    assert (one.first, one.second) == ("metres", "squared")
    with pytest.raises(BenchError, match=r"no protocol .mpjpe. here; it has mpjpe_h\.world, metres"):
        protocol_factors.chosen(explanation, ("mpjpe",), every=False)


def test_results_without_protocols_say_what_to_do(tmp_path: Path) -> None:
    bare = {id_: replace(value, protocol={}) for id_, value in VALUES.items()}
    results(tmp_path, "intra", INTRA, values=bare)
    with pytest.raises(BenchError, match="score them again"):
        explained(tmp_path)


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_protocols_are_told_apart_by_what_they_declare(name: str) -> None:
    """Every value in heights, centimetres or metres that is an error of places declares every fact."""
    card: MetricCard = create("metrics", Spec.parse(name)).card
    for value in card.values:
        if value.protocol:
            assert set(value.protocol) == set(PROTOCOL), value.id
            assert (value.protocol["self pairs"] == "in intra") == value.with_self, value.id


def test_no_two_built_in_protocols_declare_the_same() -> None:
    values = [value for name in BUILT_IN for value in create("metrics", Spec.parse(name)).card.values]
    facts = [(*value.protocol.values(), value.unit) for value in values if value.protocol]
    assert len(facts) == len(set(facts)) >= 17


# ------------------------------------------------------------------------------------- on real results
@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("explained")
    with without_processes(), pytest.raises(SystemExit) as stop:
        main(["run", "copy_rotations", "-s", "intra", "--out", str(out)])
    assert stop.value.code == 0
    return out


def test_the_command(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def table(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as stop:
            main(["table", "--protocols", "-r", str(run), *arguments])
        out, err = capsys.readouterr()
        return int(stop.value.code or 0), out + err

    code, out = table("--columns", "san_code_noself,sqdist_h2")
    assert (code, out.count("->")) == (0, 1)
    assert "san_code_noself -> sqdist_h2: x 3 in every case" in out
    code, out = table("-f", "md", "--all")
    assert code == 0
    assert "| `san_code_noself` | `sqdist_h2` | x 3 in every case |" in out
    code, out = table("-m", "copy_rotation")
    assert code == 2
    assert "did you mean copy_rotations?" in out
    code, out = table("--columns", "mpjpe")
    assert code == 2
    assert "no protocol 'mpjpe'" in out


def test_one_protocol_alone_has_no_factor(tmp_path: Path) -> None:
    results(tmp_path, "intra", INTRA)
    with pytest.raises(BenchError, match="name another beside metres"):
        protocol_factors.chosen(explained(tmp_path), ("metres", "metres"), every=False)


def test_seeds_are_told_apart(tmp_path: Path) -> None:
    learned = replace(header("mine", [], "intra").method, stochastic=True)
    results(tmp_path, "intra", INTRA, method=learned, seeds=(3,))
    assert explained(tmp_path).method == "mine, seed 3"
