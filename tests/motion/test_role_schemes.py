"""Roles of joints in the naming schemes in use."""

from __future__ import annotations

import pytest
from role_schemes import SCHEMES

from retarget_bench.motion.role_finding import find


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_scheme_is_understood(scheme: str) -> None:
    skeleton, expected = SCHEMES[scheme].body()
    assert dict(zip(skeleton.names, find(skeleton), strict=True)) == expected
