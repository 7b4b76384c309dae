"""Training of a toy: the plug-ins, its material, and a run in this process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import clips, train
from tests.in_process import carried_out_here

TOYS = Path(__file__).parent / "toys"


class Silent:
    """Remembers what a run says and shows. stop: the step after which it is interrupted."""

    def __init__(self, stop: int = 0) -> None:
        self.stop = stop
        self.said: list[str] = []
        self.moments: list[Any] = []

    def say(self, text: str) -> None:
        self.said.append(text)

    def gathering(self, done: int, total: int) -> None:
        pass

    def loading(self, done: int, total: int) -> None:
        assert 0 <= done <= total

    def began(self, run: Any) -> None:
        pass

    def show(self, status: Any) -> None:
        self.moments.append(status)
        if status.step == self.stop:
            raise KeyboardInterrupt


@pytest.fixture
def toy_plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    """``toy_trainee`` and ``toy_walks``."""
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    for name in ("toy_walks", "toy_trainee"):
        registry.add_file(TOYS / f"{name}.py")


@pytest.fixture
def toy_run(
    toy_plugins: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[Any, Silent]]:
    """Train in this process: options by name; ``stop``, the step after which it is interrupted."""
    monkeypatch.setattr(clips, "carried_out", carried_out_here)
    monkeypatch.setattr(train.log, "draw", lambda *_: None)  # takes longer than all the rest

    def run(
        out: str | Path = "run",
        method: str | None = "toy_trainee",
        data: str | None = "toy_walks",
        **others: Any,
    ) -> tuple[Any, Silent]:
        reporter = Silent(others.pop("stop", 0))
        options = train.TrainingOptions(
            Spec.parse(method) if method else None,
            Spec.parse(data) if data else None,
            out=tmp_path / out,
            device="cpu",
            **others,
        )
        try:
            return train.train(options, reporter), reporter
        except KeyboardInterrupt:
            return None, reporter

    return run
