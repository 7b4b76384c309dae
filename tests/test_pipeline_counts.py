"""Sizes of the correspondence-free pipeline's networks, by the layers that its Tables 5 to 7 list."""

from __future__ import annotations

from itertools import pairwise

import pytest

from retarget_bench.methods.smrm.network import Generator
from retarget_bench.tables.published import printed

JOINTS = 22


def linear(*sizes: int) -> int:
    """Numbers of a chain of linear layers, or of convolutions of size 1."""
    return sum((a + 1) * b for a, b in pairwise(sizes))


def transform(size: int) -> int:
    """PointNet's transform of so many features: three shared layers, the largest, three more."""
    return linear(size, 64, 128, 1024) + linear(1024, 512, 256, size * size)


def gru(size: int, hidden: int) -> int:
    """Two layers of torch's GRU: three gates, with a bias for what goes in and one for the state."""
    return sum(3 * hidden * (first + hidden + 2) for first in (size, hidden))


def skr(*transforms: int) -> int:
    shared = linear(3, 64, 128, 1024) + linear(1024, 512, 256, 3 * JOINTS)
    return shared + sum(map(transform, transforms))


def smrm(fed_back: int = 0) -> int:
    read, written = gru(3 * JOINTS + 3, 512), gru(3 * JOINTS + 512 + fed_back, 512)
    return read + written + linear(512, 4 * JOINTS) + linear(512, 3)


COUNTS = {
    "correspondence-free-table5": [skr(3, 64), skr(3)],
    "correspondence-free-table6": [smrm(), smrm(3 * JOINTS + 3)],
    "correspondence-free-table7": [
        linear(66, 256, 256, 22),
        linear(22, 256, 256, 22),
        linear(66, 256, 256, 256, 22),
    ],
}


NAMES = list(COUNTS)


def sizes(name: str, origin: str) -> list[float]:
    """The numbers of a table that are the paper's, or counts of ours; millions."""
    rows = printed.published(name).rows.values()
    return [float(row["parameters"].text) for row in rows if row["parameters"].origin == origin]


@pytest.mark.parametrize("name", NAMES)
def test_the_counts_beside_the_printed_ones_follow_from_the_layers(name: str) -> None:
    assert [round(1e6 * each) for each in sizes(name, "counted")] == COUNTS[name]


def test_which_networks_have_the_printed_sizes() -> None:
    (size,) = sizes(NAMES[0], "printed")
    assert [round(each / 1e6, 1) == size for each in COUNTS[NAMES[0]]] == [False, True]
    (size,) = sizes(NAMES[1], "printed")
    assert [round(each / 1e6, 1) == size for each in COUNTS[NAMES[1]]] == [True, False]


def test_smrm_is_the_network_that_is_counted() -> None:
    assert sum(each.numel() for each in Generator().parameters()) == smrm()
