"""Ablations of joint subsampling and consistent bone lengths (Tables 3 to 5), and of our additions."""

from retarget_bench.training.ablation import Ablation, AblationColumn, AblationRow

SELF, INTRA, CROSS = "Self", "Intra-structural", "Cross-structural"
_COLUMNS = tuple(
    AblationColumn(label, "heights", "humot_mpjpe", splits=(split,))
    for label, split in ((SELF, "self"), (INTRA, "intra"), (CROSS, "cross"))
)


def _row(label: str, parameters: dict[str, bool | float], *printed: str) -> AblationRow:
    return AblationRow(label, parameters, dict(zip((SELF, INTRA, CROSS), printed, strict=True)))


ABLATIONS = {
    "losses": Ablation(
        title="HuMoT: joint subsampling, consistent bone lengths, and what is ours",
        paper="HuMoT, Tables 3 to 5, column Overall",
        columns=_COLUMNS,
        rows=(
            _row("HuMoT, no SJS", {"subsampling": False}, "0.0093", "0.0638", "0.0552"),
            _row("HuMoT, no BLC", {"consistency": 0.0}, "0.0113", "0.0589", "0.0466"),
            AblationRow("HuMoT, bodies in their own sizes", {"sized": False}),
            AblationRow("HuMoT, bodies and limbs as they are", {"varied": False}),
            _row("HuMoT", {}, "0.0087", "0.0580", "0.0440"),
        ),
        notes=(
            "The paper has neither the usual size nor varied bodies: humot[sized=false,varied=false].",
            "Printed numbers are on Mixamo's test clips, after fine-tuning on others of Mixamo.",
            "The paper's Table 2 has the same rows by reconstruction: bench task reconstruct with the "
            "weights that this command leaves in its folder, then bench table --paper humot-table2.",
        ),
    )
}
