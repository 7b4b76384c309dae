"""The contract that retarget-bench asks of every plug-in, and room for what is special about this one."""

from retarget_bench.verification.contract import assert_contract


def test_the_contract_is_kept() -> None:
    assert_contract("methods", "my_plugin")
