"""A card of weights as lines of text, for ``bench info``. What it does not say is left out."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from retarget_bench.api import TrainingShare
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.record import DECISIVE, Record, Scores, TrainedOn, Validation, error

POINTS = 9
"""Of the validation curve: the first, the last, and evenly between them."""


def described(card: Record, share: TrainingShare | None = None) -> list[str]:
    """Fact by fact, ``what: ...``, each unwrapped. share: of its paper's training."""
    scores = card.best.scores if card.best else {}
    losses = {name: loss for name, loss in card.curve[-1].items() if name != "step"} if card.curve else {}
    facts = {
        "trained as": f"{Spec(card.method, card.facts)}, version {card.version}",
        "trained on": _data(card.data),
        "chosen by": _chosen_by(scores),
        "recipe": _recipe(card),
        "command": card.command,
        "training": _training(card),
        "windows": f"{share} of its paper's" if share else "",
        "began with": f"weights {card.init}, and a fresh optimiser" if card.init else "",
        "machine": _machine(card),
        "losses": _pairs(losses.items()),
        "scores": "; ".join(f"{split}: {_pairs(values.items())}" for split, values in scores.items()),
        "scored as": _scored_as(card) if scores else "",
        "validation": _curve(card.validation),
        "has seen": _training_data(card.training_manifest or {}),
        "note": "; ".join(card.notes),
        "hash": card.hash,
    }
    return [f"{what}: {text}" for what, text in facts.items() if text]


def hours(seconds: float) -> str:
    """``45 s``, ``12 min``, ``3.4 h``."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def _data(data: TrainedOn) -> str:
    named = f"{data.label} ({data.spec})" if data.label and data.spec else data.label or data.spec
    text = f"the training motion of {named}" if named else ""
    amount = [f"{data.clips} clips", f"{data.hours:g} h of motion"] if data.clips else []
    return ", ".join(part for part in (text, *amount) if part)


def _chosen_by(scores: Scores) -> str:
    counts = [f"{values['n']:g} {split}" for split, values in scores.items() if "n" in values]
    return (
        f"validation cases of these data ({', '.join(counts)}); test cases were not used" if counts else ""
    )


def _recipe(card: Record) -> str:
    if card.recipe is None:
        return ""
    settings = asdict(card.recipe)
    for name in ("steps", "average", "augmentation"):
        if not settings[name]:
            del settings[name]
    if augmentation := settings.pop("augmentation", None):
        settings["augmentation"] = f"({_pairs(augmentation.items())})"
    config = _pairs(settings.items())
    return f"{card.preset}: {config}" if card.preset else config


def _training(card: Record) -> str:
    if not card.steps:
        return ""
    kept = f" (kept: those of step {card.step:,})" if card.step not in (0, card.steps) else ""
    averaged = ["an exponential average of weights"] if card.recipe and card.recipe.average else []
    windows = [f"{card.steps * card.recipe.batch:,} windows"] if card.recipe else []
    steps = f"{card.steps:,} steps{kept}"
    return ", ".join((steps, *windows, *averaged, hours(card.seconds), f"seed {card.seed}"))


def _machine(card: Record) -> str:
    several = f"{card.processes} processes" if card.processes > 1 else ""
    version = f"torch {card.torch}" if card.torch else ""
    return ", ".join(part for part in (card.hardware, version, several) if part)


def _scored_as(card: Record) -> str:
    """The method as it was validated, where parameters that weights do not depend on were given."""
    own = set(Spec.parse(card.scored_as).parameters) - set(card.facts) if card.scored_as else set()
    return card.scored_as if own else ""


def _curve(validation: Sequence[Validation]) -> str:
    """The decisive value, as its mean over splits, at some of the steps."""
    if not validation:
        return ""
    last = len(validation) - 1
    chosen = (validation[k] for k in sorted({round(k * last / (POINTS - 1)) for k in range(POINTS)}))
    points = ", ".join(f"{error(each.scores):.2f} at {each.step:,}" for each in chosen)
    return f"{DECISIVE}, mean of the splits: {points}"


def _training_data(manifest: Mapping[str, Sequence[str]]) -> str:
    parts = []
    for key, names in manifest.items():
        aside = " (only to steer by)" if key == "validation" else ""
        many = len(names) > 12
        parts.append(f"{len(names)} {key}" if many else f"{key}{aside} {', '.join(names)}")
    return "; ".join(parts)


def _pairs(items: Iterable[tuple[str, Any]]) -> str:
    return ", ".join(
        f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}" for key, value in items
    )
