"""The paper's Tables 2 and 3: what the rotations' cycle loss and the length of training windows do."""

from retarget_bench.api import Ablation

_NOTES = (
    "Printed numbers are on 4 SMPL bodies x 4 Mixamo motions; the whole pipeline made them, with skeletons "
    "regressed from surfaces. Units of accelerations are not printed and assumed.",
    "Ours are SMRM alone, from and to true skeletons; vertices are those of the target's mesh under its "
    "answer, with true skinning weights.",
    "Two rows of the paper that are one configuration (with L_rot, 30 frames) differ in print: two runs.",
)

ABLATIONS = {
    "table2": Ablation(
        title="SMRM: the cycle loss on rotations",
        tables=("correspondence-free-table2",),
        rows={"With L_rot": {}, "Without L_rot": {"rotation_cycle": 0.0}},
        notes=_NOTES,
    ),
    "table3": Ablation(
        title="SMRM: how much temporal context it learns from",
        tables=("correspondence-free-table3",),
        rows={
            "0.16s (5 frames)": {"context": 5},
            "0.33s (10 frames)": {"context": 10},
            "0.5s (15 frames)": {"context": 15},
            "1s (30 frames)": {"context": 30},
            "2s (60 frames)": {"context": 60},
        },
        notes=(
            *_NOTES,
            "Here all rows have the same budget and as many windows to a step: long ones are more frames.",
        ),
    ),
}
