"""What a release carries beside the wheel: weights under flat names, and each with a model card for a hub.

    python -m tools.release_assets OUT

OUT/METHOD-NAME.safetensors is fetched by an installed wheel; OUT/hub/METHOD-NAME is a folder that can be
uploaded to a model hub as it is: README.md with metadata in YAML, the tensors and our card.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import yaml

from retarget_bench import distribution
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.card_text import described
from retarget_bench.training.learned_method import of_weights
from retarget_bench.training.record import Record

ROOT = Path(__file__).parents[1]
LABELS = {"mpjpe_h.world": "MPJPE, % of height", "mpjpe_h.root": "MPJPE, root-aligned, % of height"}


def write(folder: Path) -> None:
    """All of them, below a folder."""
    for card_path in sorted((ROOT / "methods").glob("*/weights/*.json")):
        method, name = card_path.parts[-3], card_path.stem
        tensors = card_path.with_suffix(".safetensors")
        place = folder / "hub" / f"{method}-{name}"
        place.mkdir(parents=True, exist_ok=True)
        shutil.copy(tensors, folder / f"{method}-{tensors.name}")
        for file in (card_path, tensors):
            shutil.copy(file, place)
        (place / "README.md").write_text(hub_card(method, name), encoding="utf-8")


def hub_card(method: str, name: str) -> str:
    """A model card as hubs read it: metadata, what it is, how to use it, how it was trained."""
    factory: Any = registry.load("methods", method)
    record: Record = factory.card_of(name)
    built = of_weights(method, name)
    about, usual = built.card, factory().facts()
    others = {key: value for key, value in record.facts.items() if usual[key] != value}
    spec = Spec(method, {**others, "weights": name})
    task = "" if "retarget" in about.tasks else f" --task {about.tasks[0]}"
    lines = [
        "---",
        yaml.safe_dump(metadata(method, name, record), sort_keys=False, allow_unicode=True).rstrip(),
        "---",
        "",
        f"# {method}, weights `{name}`",
        "",
        f"{about.summary}. " + (f"After: {about.paper}" if about.paper else "A method of this benchmark."),
        "",
        "## Use",
        "",
        "```sh",
        "pip install retarget-bench",
        f"bench info '{spec}'",
        *([f"bench run '{spec}'{task}"] if "motion" in about.accepts else []),
        "```",
        "",
        f"For [the benchmark]({distribution.address()}), which compares it with other methods. "
        "`bench info` says what it takes, and where shipped results show it worse than untrained methods.",
        "",
        "## Training",
        "",
        *(f"- {fact}" for fact in described(record, built.training_share)),
    ]
    return "\n".join(lines) + "\n"


def metadata(method: str, name: str, record: Record) -> dict[str, Any]:
    """The head of a card: licence, library, tags, and scores on the validation cases of its training."""
    return {
        "license": distribution.licence().lower(),
        "library_name": "retarget-bench",
        "tags": ["motion-retargeting", "character-animation", method],
        "metrics": ["mpjpe"],
        "model-index": [
            {
                "name": f"{method}-{name}",
                "results": [
                    {
                        "task": {"type": "motion-retargeting", "name": f"motion retargeting, {split}"},
                        "dataset": {"type": "motion", "name": f"validation cases of {record.data.label}"},
                        "metrics": [
                            {"type": value, "name": LABELS[value], "value": round(number, 3)}
                            for value, number in values.items()
                            if value in LABELS
                        ],
                    }
                    for split, values in (record.best.scores if record.best else {}).items()
                ],
            }
        ],
    }


if __name__ == "__main__":
    write(Path(sys.argv[1]))
