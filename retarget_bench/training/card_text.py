"""A card of weights as lines of text, for ``bench info``. Missing entries are left out."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from retarget_bench.plugins.spec import Spec

POINTS = 9
"""Of the validation curve: the first, the last, and evenly between them."""

Card = Mapping[str, Any]


def described(card: Card) -> list[str]:
    """Fact by fact, ``what: ...``, each unwrapped."""
    facts = {
        "trained as": str(Spec(str(card["method"]), card["facts"])) + f", version {card['version']}",
        "trained on": _data(card.get("data", {})),
        "chosen by": _chosen_by(card.get("scores", {})),
        "recipe": _recipe(card),
        "command": card.get("command", ""),
        "training": _training(card),
        "began with": f"weights {card['init']}, and a fresh optimiser" if card.get("init") else "",
        "machine": _machine(card),
        "losses": _pairs(card.get("losses", {}).items()),
        "scores": _scores(card.get("scores", {})),
        "scored as": _scored_as(card),
        "validation": _curve(card.get("validation", ())),
        "has seen": _training_data(card.get("training_manifest", {})),
        "note": "; ".join(card.get("notes", ())),
        "hash": str(card["hash"]),
    }
    return [f"{what}: {text}" for what, text in facts.items() if text]


def hours(seconds: float) -> str:
    """``45 s``, ``12 min``, ``3.4 h``."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def _data(data: Card) -> str:
    parts = [str(data[key]) for key in ("label", "spec") if key in data]
    text = f"{parts[0]} ({parts[1]})" if len(parts) == 2 else "".join(parts)
    text = f"the training motion of {text}" if text else ""
    amount = [f"{data['clips']} clips"] if "clips" in data else []
    amount += [f"{data['hours']:g} h of motion"] if "hours" in data else []
    return ", ".join(part for part in (text, *amount) if part)


def _chosen_by(scores: Card) -> str:
    counts = [f"{values['n']} {split}" for split, values in scores.items() if "n" in values]
    return (
        f"validation cases of these data ({', '.join(counts)}); test cases were not used" if counts else ""
    )


def _recipe(card: Card) -> str:
    timed = bool(card.get("budget")) and not str(card["budget"]).endswith("it")
    settings = {**card.get("recipe", {})}
    if timed:
        settings.pop("steps", None)
    if augmentation := settings.pop("augmentation", None):
        settings["augmentation"] = f"({_pairs(augmentation.items())})"
    config = _pairs(settings.items())
    return f"{card['preset']}: {config}" if card.get("preset") else config


def _training(card: Card) -> str:
    parts = []
    if "steps" in card:
        best = card.get("step", card["steps"])
        note = f" (kept: those of step {best:,})" if best != card["steps"] else ""
        parts.append(f"{card['steps']:,} steps{note}")
    if card.get("recipe", {}).get("average"):
        parts.append("an exponential average of weights")
    if "seconds" in card:
        parts.append(hours(card["seconds"]))
    if "seed" in card:
        parts.append(f"seed {card['seed']}")
    return ", ".join(parts)


def _machine(card: Card) -> str:
    several = f"{card['processes']} processes" if card.get("processes", 1) > 1 else ""
    version = f"torch {card['torch']}" if card.get("torch") else ""
    return ", ".join(part for part in (card.get("hardware", ""), version, several) if part)


def _scores(scores: Card) -> str:
    """``intra: mpjpe_h.world 8.1, mpjpe_h.root 5.2, n 12; cross: ...``."""
    return "; ".join(f"{split}: {_pairs(values.items())}" for split, values in scores.items())


def _scored_as(card: Card) -> str:
    """The method as it was validated, where parameters that weights do not depend on were given."""
    text = str(card.get("scored_as", ""))
    return text if text and set(Spec.parse(text).parameters) - set(card["facts"]) else ""


def _curve(validation: Sequence[Card]) -> str:
    """The first value of every validation, as its mean over splits, at some of the steps."""
    if not validation:
        return ""
    last = len(validation) - 1
    chosen = sorted({round(k * last / (POINTS - 1)) for k in range(POINTS)})
    name = next(iter(next(iter(validation[0]["scores"].values()))))
    points = (f"{_mean(validation[k], name):.2f} at {validation[k]['step']:,}" for k in chosen)
    return f"{name}, mean of the splits: {', '.join(points)}"


def _mean(entry: Card, name: str) -> float:
    scores = [values[name] for values in entry["scores"].values() if name in values]
    return sum(scores) / len(scores) if scores else float("nan")


def _training_data(manifest: Card) -> str:
    parts = []
    for key, names in manifest.items():
        aside = " (only to steer by)" if key == "validation" else ""
        many = len(names) > 12
        parts.append(f"{len(names)} {key}" if many else f"{key}{aside} {', '.join(map(str, names))}")
    return "; ".join(parts)


def _pairs(items: Iterable[tuple[str, Any]]) -> str:
    return ", ".join(
        f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}" for key, value in items
    )
