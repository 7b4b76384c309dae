"""How many examples of a property are tried: few in a plain run, many at night.

``HYPOTHESIS_PROFILE`` names a profile: ``dev`` (new examples each time), ``ci`` (the same ones each
time, the default where ``CI`` is set) or ``nightly`` (many times as many).
"""

from __future__ import annotations

import os
from typing import Any

from hypothesis import settings

NIGHTLY = 20
"""How many times as many examples are tried at night."""

settings.register_profile("dev", deadline=None, max_examples=40)
settings.register_profile("ci", deadline=None, max_examples=40, derandomize=True, print_blob=True)
settings.register_profile("nightly", deadline=None, max_examples=40 * NIGHTLY, print_blob=True)
PROFILE = os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if "CI" in os.environ else "dev")
settings.load_profile(PROFILE)


def examples(number: int, **others: Any) -> settings:
    """Settings with so many examples in a plain run, and ``NIGHTLY`` times as many at night."""
    return settings(max_examples=number * (NIGHTLY if PROFILE == "nightly" else 1), **others)
