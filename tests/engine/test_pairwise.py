"""Two methods against each other: numbers by hand, verdicts, errors, and what is printed."""

import csv
import io
import re
from dataclasses import asdict, replace

import numpy as np
import pytest
from click.testing import CliRunner
from stored import VALUES, changed, store

import retarget_bench as rb
from retarget_bench.analysis import pairwise, selection, statistics
from retarget_bench.api import TWO_LEGS
from retarget_bench.cli import group
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import result_matrix
from retarget_bench.results import store as records
from retarget_bench.tables import comparing
from retarget_bench.tables.rendering import pairwise_text

CLIPS = 20


def numbers(values: dict[str, list[float]], pairs: tuple[str, ...] = ("a>b", "b>a")) -> list:
    """Cases of every clip and pair; ``values``: value id -> a number per clip and pair."""
    cases = [(pair, f"c{clip:02}") for clip in range(CLIPS) for pair in pairs]
    return [
        (*case, {key: each[at] for key, each in values.items() if not np.isnan(each[at])})
        for at, case in enumerate(cases)
    ]


def both(root, first, second, **changes):
    store(root, "intra", "one", numbers(first))
    store(root, "intra", "two", numbers(second), **changes)
    (matrix,) = result_matrix.result_matrices(records.find_results(root))
    return matrix


def compared(matrix, values=("mpjpe_h.world", "ratio")):
    return pairwise.compare(matrix, selection.find(matrix, "one"), selection.find(matrix, "two"), values)


def test_differences_are_taken_per_case_then_per_clip_on_common_cases(tmp_path):
    random = np.random.default_rng(0)
    first, second = random.gamma(2, 1, (2, 2 * CLIPS))
    second[5] = np.nan  # one pair of the third clip
    matrix = both(tmp_path, {"mpjpe_h.world": first}, {"mpjpe_h.world": second})
    (one,) = compared(matrix).differences
    clips = [
        [a - b for a, b in zip(first[at : at + 2], second[at : at + 2], strict=True) if not np.isnan(b)]
        for at in range(0, 2 * CLIPS, 2)
    ]
    means = np.array([np.mean(each) for each in clips])
    assert one.difference == pytest.approx(means.mean(), rel=1e-7)
    assert (one.cases, one.clips) == (39, 20)
    assert one.p == statistics.sign_flip(means[None])[0]
    assert one.first - one.second == pytest.approx(one.difference, rel=1e-6)
    assert one.interval.low < one.difference < one.interval.high


def test_p_values_are_corrected_for_the_values_compared(tmp_path):
    random = np.random.default_rng(1)
    first = {key: random.gamma(2, 1, 2 * CLIPS) for key in ("mpjpe_h.world", "ratio")}
    second = {key: each * random.gamma(20, 1 / 18, 2 * CLIPS) for key, each in first.items()}
    comparison = compared(both(tmp_path, first, second))
    small, large = sorted(comparison.differences, key=lambda each: each.p)
    per_clip = []
    for each in (small, large):
        worse = [
            statistics.losses(some[each.value], each.facts.better, each.facts.goal)
            for some in (first, second)
        ]
        per_clip.append((worse[0] - worse[1]).reshape(CLIPS, 2).mean(axis=1))
    expected = statistics.step_down(np.array(per_clip))
    assert (small.adjusted, large.adjusted) == pytest.approx(tuple(expected), abs=2e-4)
    assert small.adjusted > small.p


@pytest.mark.parametrize(
    ("apart", "better", "verdict"),
    [
        (np.full(40, -1.0), "lower", "first"),
        (np.full(40, 1.0), "lower", "second"),
        (np.full(40, 1.0), "higher", "first"),
        (np.full(40, 1.0), "none", "higher"),
        (np.full(40, -1.0), "none", "lower"),
        (np.full(40, 1e-9), "lower", "same"),
        (np.tile([1.0, 1.0, -1.0, -1.0], 10), "lower", "equal"),
        (np.repeat([1.0, -1.0], [22, 18]), "lower", "open"),
    ],
)
def test_verdicts(tmp_path, apart, better, verdict):
    matrix = both(tmp_path, {"mpjpe_h.world": 10 + apart}, {"mpjpe_h.world": np.full(40, 10.0)})
    matrix.values["mpjpe_h.world"] = replace(matrix.values["mpjpe_h.world"], better=better)
    (one,) = compared(matrix).differences
    assert one.verdict == verdict
    assert verdict == "open" or pairwise_text.verdict(compared(matrix), one) != "not significant"


def few_clips(root, clips, values):
    """Two methods of which the first is better by 1 in all these values on every clip."""
    for name, size in (("one", 1.0), ("two", 2.0)):
        store(
            root, "intra", name, [("a>b", f"c{n}", dict.fromkeys(values, size + n)) for n in range(clips)]
        )
    (matrix,) = result_matrix.result_matrices(records.find_results(root))
    return compared(matrix, values)


@pytest.mark.parametrize(
    ("clips", "words", "reserve"),
    [
        (9, "too few clips", False),
        (10, "one better on such clips", True),
        (73, "one better on such clips", True),
        (74, "one better", False),
    ],
)
def test_from_10_clips_on_there_is_a_verdict_and_from_74_on_without_reserve(
    tmp_path, clips, words, reserve
):
    comparison = few_clips(tmp_path, clips, ("mpjpe_h.world",))
    (one,) = comparison.differences
    assert pairwise_text.verdict(comparison, one) == words
    assert ((one.interval, one.clips_needed) == (None, 10)) == (clips == 9)
    assert ("too few clips, needs 10" in pairwise_text.text([comparison])) == (clips == 9)
    assert ("can miss failures on up to" in pairwise_text.text([comparison])) == reserve


def test_an_open_verdict_says_about_how_many_clips_would_close_it(tmp_path):
    random = np.random.default_rng(5)
    first = random.gamma(2, 1, 2 * CLIPS)
    second = first * random.gamma(20, 1 / 19, 2 * CLIPS)
    comparison = compared(both(tmp_path, {"mpjpe_h.world": first}, {"mpjpe_h.world": second}))
    (one,) = comparison.differences
    assert one.verdict == "open"
    assert one.clips_needed == statistics.clips_for_power(one.p, one.adjusted, CLIPS) > CLIPS
    row = next(line for line in pairwise_text.text([comparison]).splitlines() if "world ↓" in line)
    (shown,) = re.findall(r"not significant \(about (\d+) clips\)$", row)
    assert int(shown) == pytest.approx(one.clips_needed, rel=0.05)


def test_clips_won_follow_the_direction_of_the_value(tmp_path):
    apart = np.repeat([-1.0] * 14 + [1.0] * 5 + [0.0], 2)
    matrix = both(tmp_path, {"mpjpe_h.world": 10 + apart}, {"mpjpe_h.world": np.full(40, 10.0)})
    for better, won in (("lower", (14, 5)), ("higher", (5, 14)), ("none", (5, 14)), ("target", (14, 5))):
        matrix.values["mpjpe_h.world"] = replace(matrix.values["mpjpe_h.world"], better=better, goal=1.0)
        (one,) = compared(matrix).differences
        assert one.won == won


# ------------------------------------------------------------------------------------------- command
@pytest.fixture
def runs(tmp_path):
    random = np.random.default_rng(2)
    first = random.gamma(2, 1, 2 * CLIPS)
    root = tmp_path / "runs"
    values = {"mpjpe_h.world": first, "ratio": np.full(2 * CLIPS, 1.0)}
    worse = {"mpjpe_h.world": 1.5 * first, "ratio": np.full(2 * CLIPS, 1.0)}
    both(root, values, worse, privileged=["reference"])
    return root


def bench(*words) -> str:
    result = CliRunner().invoke(group, ["compare", *map(str, words)], standalone_mode=False)
    if isinstance(result.exception, BenchError):
        raise result.exception
    assert result.exception is None, result.exception
    return result.output


def test_text_says_who_is_better_and_by_how_much(runs, monkeypatch):
    monkeypatch.setenv("COLUMNS", "150")
    shown = bench("one", "two", "--results", runs, "--columns", "mpjpe_h.world,ratio")
    assert re.search(
        r"↓, % of height: one better on such clips\n .*-1\.\d+ +\[-[\d.]+, -[\d.]+\] +<0\.001 +20 +20:0\n",
        shown,
    )
    assert "data, intra; 40 cases\n" in shown
    assert "* two sees reference" in shown
    assert "the same" in next(line for line in shown.splitlines() if "ratio" in line)


@pytest.mark.parametrize(
    ("p", "shown"),
    [(0.0009, "<0.001"), (0.0494, "0.049"), (0.0498, "<0.05"), (0.05, "0.050"), (1.0, "1.000")],
)
def test_a_p_value_is_never_written_as_if_it_were_on_the_other_side_of_the_level(p, shown):
    assert pairwise_text._p(p) == shown


def test_csv_reads_back_and_markdown_survives_hostile_names(runs, tmp_path):
    rows = list(csv.DictReader(io.StringIO(bench("one", "two", "--results", runs, "--all", "-f", "csv"))))
    assert [row["value"] for row in rows] == ["mpjpe_h.world", "ratio"]
    assert rows[0]["verdict"] == "one better on such clips"
    assert (rows[0]["first_won"], rows[0]["second_won"], rows[0]["clips_needed"]) == ("20", "0", "")
    assert float(rows[0]["low"]) < float(rows[0]["difference"]) < float(rows[0]["high"]) < 0
    hostile = "a|b<script>*_[x]"
    store(runs, "intra", "odd", numbers({"mpjpe_h.world": np.full(2 * CLIPS, 2.0)}), label=hostile)
    shown = bench("one", hostile, "--results", runs, "-f", "md", "-o", tmp_path / "out.md")
    assert shown == f"wrote {tmp_path / 'out.md'}\n"
    text = (tmp_path / "out.md").read_text()
    assert "<script>" not in text
    table = [line for line in text.splitlines() if line.startswith("|")]
    assert len({line.replace("\\|", "").count("|") for line in table}) == 1


def test_folders_compare_a_method_with_itself(runs, tmp_path):
    later = tmp_path / "later"
    random = np.random.default_rng(3)
    store(later, "intra", "one", numbers({"mpjpe_h.world": random.gamma(2, 1, 2 * CLIPS)}))
    shown = bench(runs, later, "--columns", "mpjpe_h.world")
    assert f"one ({runs}) against one ({later})" in " ".join(shown.split())
    assert "two against" not in shown
    assert "against two" not in shown


def test_python_pools_self_pairs_as_the_command_does(tmp_path):
    """On a split alone: the mean of a clip is over its case in ``intra`` and the one in ``self``."""
    for name, error in (("one", 1.0), ("two", 3.0)):
        clips = [f"c{n}" for n in range(12)]
        store(tmp_path, "intra", name, [("a>b", clip, {"pooled": error}) for clip in clips])
        store(tmp_path, "self", name, [("a>a", clip, {"pooled": 0.0}) for clip in clips])
    results = rb.load_results(tmp_path)
    (row,) = results.compare("one", "two", "pooled", splits="intra").frame.itertuples()
    assert (row.first_mean, row.second_mean, row.cases) == (0.5, 1.5, 24)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["one", "tow"], "no results of 'tow' here; did you mean two"),
        (["one", "unlike"], "no results of 'unlike' here; there are those of one, two"),
        (
            ["one", "two", "--columns", "mpjpe"],
            "no result has a value 'mpjpe'; the nearest are mpjpe_h.world",
        ),
        (["one", "two", "--columns", "curve"], "is a curve with a number per threshold"),
        (["one", "two", "--columns", ","], "columns: ',' names nothing"),
        (["one", "two", "-s", "cross"], "no case in common|no results"),
        (["one", "two", "--results", "nowhere"], "no results in nowhere"),
        (["one", "two", "-d", "nothing"], "no results of nothing in"),
        (["one", "two", "--columns", "pooled"], "one and two have no case in common"),
        (["one", "two", "--columns", "ratio_src"], "--against source shows ratio, source"),
    ],
)
def test_mistakes_are_told_in_a_sentence(runs, words, message):
    with pytest.raises(BenchError, match=message):
        bench(*words, "--results", runs)


def test_values_left_out_are_named_with_the_reason(tmp_path):
    full = {key: np.full(2 * CLIPS, 1.0) for key in ("mpjpe_h.world", "ratio")}
    store(tmp_path, "intra", "one", numbers(full))
    store(tmp_path, "intra", "two", numbers({"mpjpe_h.world": np.full(2 * CLIPS, 2.0)}))
    for place in records.find_results(tmp_path):
        fid = VALUES["ratio"] | {"label": "FID"}
        needs = VALUES | {"ratio": VALUES["ratio"] | {"needs": ["rotations"]}}
        changed(place, set_values={"fid": fid}, values=needs)
    matrices = result_matrix.result_matrices(records.find_results(tmp_path))
    (comparison,) = comparing.compare(matrices, "one", "two", ["mpjpe_h.world", "ratio", "FID"])
    assert [each.value for each in comparison.differences] == ["mpjpe_h.world"]
    (note,) = [note for note in comparison.notes if note.startswith("not compared: ")]
    assert "ratio (two: needs rotations)" in note
    assert "FID (computed of all answers to bodies of one group" in note
    (usual,) = comparing.compare(matrices, "one", "two")
    assert [note for note in usual.notes if "FID" in note]
    with pytest.raises(BenchError, match="no case in common"):
        comparing.compare(matrices, "one", "two", ["FID"])


def of_sets(root, tenths, **changes):
    """A matrix of people with values of sets; tenths: method -> ``(10,)`` values without a tenth each."""
    fid = VALUES["mpjpe_h.world"] | {"label": "FID", "tolerance": 1e-2, "metric": "fid"}
    for name, without in tenths.items():
        place = store(root, "intra", name, numbers({"mpjpe_h.world": np.full(2 * CLIPS, 1.0)}))
        value = SetValue("fid", TWO_LEGS, 90, CLIPS, float(without.mean()), real="r")
        one_body = replace(value, value_id="kid", structure="body22", without=tuple(without))
        set_metrics.write(
            place, [replace(value, **({"without": tuple(without)} | changes.get(name, {}))), one_body]
        )
        changed(place, set_values={"fid": fid, "kid": fid | {"label": "KID"}})
    (matrix,) = result_matrix.result_matrices(records.find_results(root))
    return replace(matrix, bodies="people")


def test_values_of_sets_are_compared_by_the_paired_jackknife(tmp_path):
    """Both move alike without a tenth, so that a difference far below their spread is one."""
    random = np.random.default_rng(6)
    shared, own = random.normal(size=10), 0.01 * random.normal(size=(3, 10))
    matrix = of_sets(
        tmp_path, {"one": 5 + shared, "two": 5.1 + shared + own[1], "three": 7.0 + shared + own[2]}
    )
    (comparison,) = comparing.compare([matrix], "one", "two", ["fid"])
    (fid,) = comparison.differences
    apart = 0.1 + own[1]
    error = 3 * np.std(apart)  # the jackknife's: sqrt(9/10 of the sum of squares)
    assert fid.difference == pytest.approx(-apart.mean(), rel=1e-6)
    assert fid.interval.low < fid.difference < fid.interval.high
    assert fid.interval.high - fid.interval.low == pytest.approx(2 * 2.26 * error, rel=0.3)
    assert (fid.verdict, fid.cases, fid.clips) == ("first", 90, CLIPS)
    ranking = comparing.table_rankings(matrix)["fid"]
    assert fid.adjusted == ranking.p["two"]
    (comparison,) = comparing.compare([matrix], "two", "three", ["fid", "kid"])
    fid, kid = comparison.differences
    assert (fid.facts.label, kid.facts.label) == ("FID", "KID, body22")
    assert fid.adjusted == kid.adjusted == statistics.step_down(fid.apart[None])[0]
    assert "by the paired jackknife" in " ".join(pairwise_text.text([comparison]).split())


@pytest.mark.parametrize("other", [{"real": "x"}, {"without": ()}])
def test_values_of_other_sets_are_not_compared(tmp_path, other):
    tenths = {name: np.arange(10.0) for name in ("one", "two")}
    matrix = of_sets(tmp_path, tenths, two=other)
    (comparison,) = comparing.compare([matrix], "one", "two", ["mpjpe_h.world", "fid"])
    assert [each.value for each in comparison.differences] == ["mpjpe_h.world"]
    assert "not compared: FID (needs an interval of both, over the same windows)" in comparison.notes


def test_different_data_are_never_compared(runs):
    place = next(p for p in records.find_results(runs) if p.method == "two")
    dataset = asdict(records.read_header(place.header).dataset) | {"content": "c2"}
    changed(place, dataset=dataset)
    with pytest.raises(BenchError, match=r"scored on different data called data \(c1; c2\)"):
        bench("one", "two", "--results", runs)
