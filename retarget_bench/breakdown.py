"""One panel into several: by pair, clip or kind of performance."""

from __future__ import annotations

from typing import Literal

import numpy as np

from retarget_bench.panel import Panel

By = Literal["pair", "clip", "kind", "joint", "part", "seen"]


def broken_down(panel: Panel, by: By) -> list[Panel]:
    """A panel per group, in alphabetical order."""
    names = np.array([str(getattr(info, by)) for info in panel.cases])
    return [panel.restricted(names == name, name) for name in sorted(set(names.tolist()))]
