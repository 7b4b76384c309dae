"""The paper's Tables 2 and 3: what the rotations' cycle loss and the length of training windows do."""

from retarget_bench.training.ablation import Ablation, AblationColumn, AblationRow

_COLUMNS = (
    AblationColumn("MPJPE", "m", "mpjpe_h.world"),
    AblationColumn("PA-MPJPE", "m", "pa_mpjpe.rigid"),
    AblationColumn("Acc", "m/frame^2", "acc"),
    AblationColumn("PA-Acc", "m/frame^2", "pa_acc.rigid"),
    AblationColumn("MPVD", "m", "mpvd_h"),
    AblationColumn("PA-MPVD", "m", "pa_mpvd.rigid"),
    AblationColumn("MEDL", "m", "medl_h"),
)
_NOTES = (
    "Printed numbers are on 4 SMPL bodies x 4 Mixamo motions; the whole pipeline made them, with skeletons "
    "regressed from surfaces. Units of accelerations are not printed and assumed.",
    "Ours are SMRM alone, from and to true skeletons; vertices are those of the target's mesh under its "
    "answer, with true skinning weights.",
    "Two rows of the paper that are one configuration (with L_rot, 30 frames) differ in print: two runs.",
)


def _row(label: str, parameters: dict[str, float | int], printed: str) -> AblationRow:
    names = (column.label for column in _COLUMNS)
    return AblationRow(label, parameters, dict(zip(names, printed.split(), strict=True)))


ABLATIONS = {
    "table2": Ablation(
        title="SMRM: the cycle loss on rotations",
        paper="Correspondence-free online human motion retargeting (HAL v1), Table 2",
        columns=_COLUMNS,
        rows=(
            _row("With L_rot", {}, "0.180 0.055 0.016 0.008 0.147 0.054 0.001"),
            _row("Without L_rot", {"rotation_cycle": 0.0}, "0.192 0.074 0.020 0.009 0.160 0.077 0.002"),
        ),
        notes=_NOTES,
    ),
    "table3": Ablation(
        title="SMRM: how much temporal context it learns from",
        paper="Correspondence-free online human motion retargeting (HAL v1), Table 3",
        columns=_COLUMNS,
        rows=(
            _row("0.16s (5 frames)", {"context": 5}, "0.195 0.081 0.014 0.009 0.161 0.074 0.001"),
            _row("0.33s (10 frames)", {"context": 10}, "0.176 0.062 0.014 0.008 0.149 0.061 0.001"),
            _row("0.5s (15 frames)", {"context": 15}, "0.174 0.059 0.016 0.009 0.143 0.058 0.001"),
            _row("1s (30 frames)", {"context": 30}, "0.178 0.056 0.016 0.008 0.145 0.058 0.001"),
            _row("2s (60 frames)", {"context": 60}, "0.194 0.061 0.016 0.008 0.160 0.059 0.001"),
        ),
        notes=(
            *_NOTES,
            "Here all rows have the same budget and as many windows to a step: long ones are more frames.",
        ),
    ),
}
