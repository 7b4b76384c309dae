"""The leaderboard: tables of all submissions in a folder, and one of what each method costs."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from retarget_bench.analysis.summary import split_summaries
from retarget_bench.errors import BenchError, printable
from retarget_bench.exchange import card
from retarget_bench.exchange.card import CARD, Card
from retarget_bench.exchange.checking import LONGEST, check, unsafe
from retarget_bench.results import store
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder
from retarget_bench.tables.model import Cell, Column, Group, Row, Table

AHEAD = "frames after the present one that the method needs; clip: the whole clip, so it cannot run live"
COSTS = (
    Column("parameters", "parameters", "1", "none", "numbers that were learnt"),
    Column("training_hours", "training", "hours", "none", "training of all runs behind the weights"),
    Column("peak_memory_mb", "memory", "MB", "none", "what a process grows by while it retargets"),
    Column("lookahead_frames", "look-ahead", "frames", "none", AHEAD),
    Column("frames_per_second", "speed", "frames/s", "none", "of one process and one thread"),
)
"""Fields of cards."""
LAST = "9999"
"""After every date."""


def leaderboard(folder: Path, root: str | None = None) -> tuple[list[Table], list[str]]:
    """Tables of every sound submission in a folder, and sentences about those left out.

    Of two that are equal, or of one method, the older one is shown, by the dates of their rows. root: see
    ``check``. Raises BenchError where the folder has none.
    """
    folders = sorted((path.parent for path in folder.glob(f"*/{CARD}")), key=_age)
    if not folders:
        raise BenchError(f"{folder} holds no submissions: folders of results with a {CARD}")
    left_out: list[str] = []
    cards: dict[str, Card] = {}
    places: list[ResultPaths] = []
    for each in folders:
        try:
            results = _sound(each, root, places)
            label = store.read_header(results[0].header).method.label
            if label in cards:
                raise BenchError(f"{label} is submitted twice")
            cards[label] = card.read(each)
            places += results
        except Exception as error:  # a submission may hold anything; the others are shown
            problem = str(error) or type(error).__name__
            left_out.append(printable(f"{each.name} is left out: {problem}")[:LONGEST])
    left_out.sort()
    if not cards:
        raise BenchError("no submission is sound. " + ". ".join(left_out))
    return [*builder.tables(split_summaries(places)), _costs(cards, left_out)], left_out


def _sound(folder: Path, root: str | None, others: Sequence[ResultPaths]) -> list[ResultPaths]:
    """The results of a submission. Raises BenchError where it has errors, or the very rows of another."""
    errors, _ = check(folder, root)
    if errors:
        raise BenchError(errors[0])
    results = store.find_results(folder)
    for one in results:
        entries = store.read_results(one).entries
        for other in others:
            if one.split == other.split and entries == store.read_results(other).entries:
                raise BenchError(f"its rows are those of {other.root.name}")
    return results


def _age(folder: Path) -> tuple[str, str]:
    """Sorts submissions by when the last of their rows were made; those that do not say come last."""
    dates = []
    with suppress(BenchError):
        for place in [] if any(unsafe(folder)) else store.find_results(folder):
            dates.append(store.read_header(place.any_header).date or LAST)
    return max(dates, default=LAST), folder.name


def _costs(cards: Mapping[str, Card], left_out: Sequence[str]) -> Table:
    """The table of costs, with credits and what is left out below."""
    listed = sorted(cards.items())
    rows = [
        Row(label, "", tuple(_cell(getattr(each, column.id)) for column in COSTS), "")
        for label, each in listed
    ]
    notes = (*(_credit(label, each) for label, each in listed), *left_out)
    group = Group("as submitted", "", COSTS, tuple(rows), ())
    reading = "Measured on the submitters' machines, so not ranked."
    return Table("Cost", (group,), notes=notes, reading=reading)


def _cell(number: float | str) -> Cell:
    return Cell("clip", math.inf) if number == "clip" else Cell(f"{number:,.12g}", float(number))


def _credit(label: str, about: Card) -> str:
    links = "".join(f"; {link}" for link in (about.paper, about.code, about.contact) if link)
    hardware = f" on {about.hardware}" if about.hardware else ""
    return (
        f"{label} {about.version}: {about.summary}. By {', '.join(about.authors)}; {about.licence}{links}. "
        f"Trained on {', '.join(about.trained_on) or 'nothing'}{hardware}."
    )
