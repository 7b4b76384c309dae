"""What takes part in a run when nothing is named."""

from pathlib import Path

import pytest

from retarget_bench.plugins import registry
from retarget_bench.python import plans

CLASHING = '''"""A metric that uses a built-in's value id."""

from retarget_bench.api import MetricCard, Value


class Clash:
    card = MetricCard("clash", "clash", "1", (Value("mpjpe_h.world", "", "", "1", "lower", "", ""),))

    def compute(self, comparison):
        return {"mpjpe_h.world": 1.0}


plugin = Clash
'''


def test_a_plain_run_has_the_variants_that_a_card_names() -> None:
    specs = [str(spec) for spec in plans.default_methods("retarget", pytest.fail)]
    assert len(specs) == len(set(specs))
    for suffix in ("", "[root_rule=none]", "[root_rule=reference]"):
        assert f"copy_rotations{suffix}" in specs


def test_a_metric_that_takes_anothers_value_id_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    (tmp_path / "clash.py").write_text(CLASHING)
    registry.add_file(tmp_path / "clash.py")
    messages: list[str] = []
    metrics = plans.default_metrics("retarget", messages.append)
    assert "clash" not in metrics
    assert "position" in metrics
    assert "both declare 'mpjpe_h.world'" in "".join(messages)
