"""Numbers that are computed when they are asked for: of a million cases a table shows few values."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TypeVar

T = TypeVar("T")


class OnDemand(Mapping[str, T]):
    """What is known by value id, of which only what is asked for is computed.

    compute: puts what there is of a value into ``found``.
    """

    def __init__(self, ids: Iterable[str], compute: Callable[[str], None]) -> None:
        self.ids, self.compute = tuple(ids), compute
        self.found: dict[str, T] = {}

    def __contains__(self, value: object) -> bool:
        self.compute(str(value))
        return value in self.found

    def __getitem__(self, value: str) -> T:
        self.compute(value)
        return self.found[value]

    def __iter__(self) -> Iterator[str]:
        return (value for value in self.ids if value in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __bool__(self) -> bool:
        return any(True for _ in self)

    def __eq__(self, other: object) -> bool:
        return dict(self) == other
