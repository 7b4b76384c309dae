"""The gate has been seen red: methods and data broken on purpose, against our golden rows."""

from dataclasses import replace

import numpy as np
import pytest
from gates import FOLDER, quiet

from retarget_bench.plugins import registry
from retarget_bench.verification.gate import golden, method_rows, report, run
from retarget_bench.verification.gate.compare import Status


@pytest.fixture
def checked(tmp_path):
    def check(*methods):
        return run.check(FOLDER, tmp_path, methods, None, quiet)[0]

    return check


def test_the_methods_are_green(checked):
    comparison = checked("copy_rotations", "reference")
    assert comparison.verdict == 0
    assert comparison.compared > 300


def test_every_method_of_a_plain_run_has_golden_rows():
    assert set(golden.read(FOLDER).under("weights")) == set(method_rows.default_methods())


def answer(change):
    """Replaces what copy_rotations answers."""
    from retarget_bench.methods.copy_rotations import CopyRotations

    before = CopyRotations.retarget

    def broken(self, source, target, *, context):
        return change(before(self, source, target, context=context), source, target)

    return CopyRotations, "retarget", broken


def exchanged(motion, source, target):
    """What the left side should do the right side does, and the other way round."""
    twin = list(range(len(target.skeleton)))
    for role, joint in target.joint_of.items():
        other = {"left": "right", "right": "left"}.get(role.split("_")[0])
        twin[joint] = target.joint_of.get(f"{other}_{role.split('_', 1)[-1]}", joint)
    return replace(motion, rotations=motion.rotations[:, twin])


BROKEN = {
    "frozen": lambda m, s, t: m.at(np.zeros(m.frames, dtype=int)),
    "left and right exchanged": exchanged,
    "a tenth of a millimetre up": lambda m, s, t: replace(m, root=m.root + np.array([0.0, 1e-4, 0.0])),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_method_is_seen(checked, monkeypatch, name):
    monkeypatch.setattr(*answer(BROKEN[name]))
    comparison = checked("copy_rotations")
    assert comparison.verdict == 1
    assert {each.status for each in comparison.changes} & {Status.WORSE, Status.BETTER}


def test_a_root_one_percent_longer_is_told_by_a_handful_of_values(checked, monkeypatch):
    monkeypatch.setattr(*answer(lambda m, s, t: replace(m, root=1.01 * m.root)))
    comparison = checked("copy_rotations")
    assert len(comparison.changes) > 100
    lines = [line.split() for line in report.text(comparison).splitlines() if " copy_rotations " in line]
    assert len(lines) <= 14
    (line,) = (each for each in lines if each[0] == "worse" and each[2] == "mpjpe_h.world")
    # of a body copied onto itself, 1 % of the height of its hips, which is about half of its own
    assert line[3] == "self"
    assert line[5].startswith("0.5")
    assert len(report.text(comparison, everything=True).splitlines()) > len(comparison.changes)


def test_self_pairs_that_slip_into_intra_are_seen(checked, monkeypatch):
    Puppets = type(registry.create("datasets", "puppets"))
    cases = Puppets.cases

    def slipped(self, task, split):
        more = cases(self, task, "self") if split == "intra" else []
        return [*cases(self, task, split), *(replace(info, split="intra") for info in more)]

    monkeypatch.setattr(Puppets, "cases", slipped)
    comparison = checked("copy_rotations")
    assert comparison.verdict == 1
    (change,) = comparison.changes
    assert (change.status, change.where) == (Status.INCOMPARABLE, "intra")
