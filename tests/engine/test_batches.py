"""Methods that take several cases at once: what is asked together, and what becomes of a fault."""

from itertools import combinations
from types import SimpleNamespace

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from small_plans import asked, carry_out

from retarget_bench.api import CaseInfo
from retarget_bench.evaluation import batches, plan
from retarget_bench.plugins import registry
from retarget_bench.results import store
from retarget_bench.training import validate

pytestmark = pytest.mark.usefixtures("in_process", "toys")

HEIGHTS = {"small": 1.0, "tall": 1.5}
BONES = 0.3 + 0.4 + (0.1**2 + 0.05**2) ** 0.5 + 0.8  # of toy_cases' bodies of height 1
SHIFT = 0.01  # as in toys/toy_cases.py
MICROMETRE = 1e-6
FRAMES = 12  # of every case of toy_cases


def mates(results: store.Results, case: str) -> float:
    """With how many cases a case was asked, itself included, told from its error (0: alone)."""
    entry = next(entry for entry in results.entries if entry.case == case)
    target = results.cases[case].target
    metres = entry.values["mpjpe_h.world"] / 100 * HEIGHTS[target] * BONES
    return round((SHIFT - metres) / MICROMETRE / FRAMES, 2)


# ------------------------------------------------------------------------------------- what is together
def listed(*cases: tuple[str, str, int]) -> list[CaseInfo]:
    return [
        CaseInfo(f"case {number}", "retarget", "cross", source, target, "clip", frames=frames)
        for number, (source, target, frames) in enumerate(cases)
    ]


CAST = {name: SimpleNamespace(structure=name[0]) for name in ("a1", "a2", "b1", "b2")}
LENGTHS = st.one_of(st.integers(0, 240), st.integers(0, 2 * batches.FRAMES))
LISTS = st.lists(
    st.tuples(st.sampled_from(sorted(CAST)), st.sampled_from(sorted(CAST)), LENGTHS), max_size=60
)


@given(LISTS)
def test_batches_hold_every_case_once_and_no_more_than_fits(cases):
    infos = {info.id: info for info in listed(*cases)}
    groups = batches.batches(list(infos.values()), CAST)
    assert sorted(case for batch in groups for case in batch) == sorted(infos)
    for batch in groups:
        longest = max(infos[case].frames for case in batch)
        assert len(batch) <= batches.CASES
        assert len(batch) == 1 or len(batch) * longest <= batches.FRAMES
        assert len({(infos[case].source[0], infos[case].target[0]) for case in batch}) == 1


@given(LISTS)
def test_no_batch_shows_what_another_of_its_cases_asks_for(cases):
    infos = {info.id: info for info in listed(*cases)}
    for batch in batches.batches(list(infos.values()), CAST):
        moved = [infos[case] for case in batch if infos[case].source != infos[case].target]
        requested = {(info.target, info.clip) for info in moved}
        assert not requested & {(info.source, info.clip) for info in moved}


@given(LISTS)
def test_no_batch_could_have_taken_the_first_of_a_later_one(cases):
    infos = {info.id: info for info in listed(*cases)}
    for earlier, later in combinations(batches.batches(list(infos.values()), CAST), 2):
        first, others = infos[later[0]], [infos[case] for case in earlier]
        if (first.source[0], first.target[0]) != (others[0].source[0], others[0].target[0]):
            continue
        longest = max(info.frames for info in (first, *others))
        full = len(others) == batches.CASES or (len(others) + 1) * longest > batches.FRAMES
        visible = any(
            first.clip == other.clip and (first.source == other.target or first.target == other.source)
            for other in others
        )
        assert full or visible


# ----------------------------------------------------------------------------------------------- in runs
def test_cases_are_asked_together_and_the_refused_are_left_out(tmp_path):
    mix, picky = carry_out(tmp_path, "toy_batches", "toy_batches[does=picky]")
    # of six cases three are from one body to the other, and three the same clips back
    assert {mates(mix, entry.case) for entry in mix.entries} == {3}
    assert picky.header.counts.unsupported == 3
    assert {mates(picky, entry.case) for entry in picky.entries if entry.status == "ok"} == {3}


@pytest.mark.parametrize(
    ("does", "status", "words"),
    [
        ("raise", "failed", "RuntimeError: no idea"),
        ("nan", "invalid", "not finite"),
        ("few", "failed", "IndexError"),
        pytest.param("die", "failed", "signal SIGKILL", marks=pytest.mark.processes),
    ],
)
def test_a_fault_in_a_batch_costs_its_own_row(tmp_path, does, status, words):
    _, bad, plain = carry_out(tmp_path, "toy_batches", f"toy_batches[does={does}]", "toy_method")
    lost = {entry.case: entry for entry in bad.entries if entry.status != "ok"}
    assert {bad.cases[case].clip for case in lost} == {"clip 1"}
    assert len(lost) == 2
    assert all(entry.status == status and words in entry.message for entry in lost.values())
    assert {mates(bad, entry.case) for entry in bad.entries if entry.case not in lost} == {0}
    assert {entry.status for entry in plain.entries} == {"ok"}


@pytest.mark.parametrize("where", ["supports", "retarget_batch", "retarget"])
def test_an_interrupt_is_told_and_ends_a_validation(monkeypatch, where):
    """Ctrl-C comes once: whoever is asked afterwards answers as if nothing had been."""
    method, pressed = registry.create("methods", "toy_batches"), []

    def interrupted(*args, **options):
        if not pressed:
            pressed.append(where)
            raise KeyboardInterrupt
        return usual(*args, **options)

    data = registry.create("datasets", "toy_cases")
    if where == "retarget":
        monkeypatch.setattr(method, "retarget_batch", None, raising=False)
    judge = validate.Validator(data, method, 2, torch.device("cpu"), lambda done, total: None)
    usual = getattr(method, where)
    monkeypatch.setattr(method, where, interrupted)
    with pytest.raises(KeyboardInterrupt):
        judge(torch.nn.ModuleDict(), method)
    assert pressed


def test_what_is_missing_of_a_batch_is_made_by_the_whole_batch_and_stored_alone(tmp_path):
    (first,) = carry_out(tmp_path, "toy_batches")
    expected = first.paths.rows.read_bytes()
    files = sorted((first.paths.folder / "toy_batches").glob("*.npz"))
    before = {file: file.stat().st_mtime_ns for file in files[1:]}
    content = files[0].read_bytes()
    files[0].unlink()
    first.paths.header.unlink()
    (again,) = carry_out(tmp_path, "toy_batches")
    assert again.paths.rows.read_bytes() == expected
    assert files[0].read_bytes() == content
    assert {file: file.stat().st_mtime_ns for file in files[1:]} == before


def test_only_methods_that_take_batches_are_known_by_them(tmp_path):
    mix, plain = plan.evaluation_units(asked(tmp_path, "toy_batches", "toy_method"))
    assert mix.prediction_facts["batches"] == {"cases": 16, "frames": 28_800, "apart": True}
    assert "batches" not in plain.prediction_facts
    assert plain.batches == mix.batches
