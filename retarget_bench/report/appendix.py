"""What a page for a paper's appendix says: table, protocol, versions, keys, and what checklists ask for."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from retarget_bench import distribution
from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.api import PAIRED, Method
from retarget_bench.api.completing import whole
from retarget_bench.api.datasets import DatasetCard
from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.parameters import class_card
from retarget_bench.plugins.spec import Spec
from retarget_bench.report.chapters import Chapter
from retarget_bench.report.page import GOALS
from retarget_bench.results.header import MethodInfo, ResultHeader
from retarget_bench.tables import builder, provenance
from retarget_bench.tables.method_groups import speeds
from retarget_bench.tables.model import Cell, Group, Table, count, listed
from retarget_bench.tables.rendering import as_latex, words
from retarget_bench.training import card_text

GOAL = "Asked for was the source's motion on the target's body."
UNKNOWN = "unknown"
DIGITS = 8
"""Of keys and checksums, which have more."""


@dataclass(frozen=True)
class Appendix:
    """The content of a page.

    groups: of its table. below: sentences directly below it. items: headings, and what stands under each.
    """

    title: str
    lead: str
    groups: tuple[Group, ...]
    below: tuple[str, ...]
    items: tuple[tuple[str, str], ...]


def appendix(chapter: Chapter) -> Appendix:
    """The page of a chapter, with its first table: of all splits side by side, where there are several."""
    table = chapter.tables[0]
    groups = tuple(each for part in chapter.tables for each in part.groups if not each.structure)
    beside = any(column.split for group in groups[:1] for column in group.columns)
    facts = _Facts(chapter, table, groups[:1] if beside else groups)
    numbers = {cell.footnote for cell in facts.cells}
    footnotes = (f"[{n}] {each}" for n, each in enumerate(table.footnotes, 1) if n in numbers)
    intervals = any(cell.interval for cell in facts.cells)
    reading = words.reading([replace(table, groups=facts.groups)], intervals, signs=as_latex.SIGNS)
    below = (" ".join(reading), *(line for each in facts.groups for line in each.below), *footnotes)
    items = {
        "Protocol": facts.protocol(),
        "What may not be concluded": facts.limits(),
        "Not shown": facts.not_shown(),
        "Seeds and runs": facts.seeds(),
        "Data and licence": facts.data(),
        "Training of learned methods": facts.training(),
        "Compute": facts.compute(),
        "Code and versions": facts.code(),
        "The numbers again": "; ".join(provenance.commands(facts.sections)),
        "Methods, licences, keys, checksums": facts.methods(),
    }
    title = f"Motion retargeting: {table.title}"
    return Appendix(title, table.finding, facts.groups, tuple(filter(None, below)), tuple(items.items()))


@dataclass(frozen=True)
class _Facts:
    """What the items are made of."""

    chapter: Chapter
    table: Table
    groups: tuple[Group, ...]

    @cached_property
    def sections(self) -> list[SplitSummary]:
        return builder.in_order([split.section for split in self.chapter.splits])

    @cached_property
    def headers(self) -> dict[str, ResultHeader]:
        """Label -> the header on the first split, of the methods of the table, by rank."""
        there = {score.label: score.header for each in self.sections[::-1] for score in each.scores}
        names = [
            each.label for group in self.groups for each in (group.columns if group.subject else group.rows)
        ]
        return {label: there[label] for label in dict.fromkeys(names) if label in there} or there

    @property
    def methods_shown(self) -> dict[str, MethodInfo]:
        return {label: header.method for label, header in self.headers.items()}

    @property
    def newest(self) -> ResultHeader:
        return max(self.headers.values(), key=lambda each: each.date)

    @property
    def marked(self) -> bool:
        return any(cell.mark for cell in self.cells)

    @cached_property
    def cells(self) -> list[Cell]:
        return [cell for group in self.groups for row in group.rows for cell in row.cells]

    # ------------------------------------------------------------------------------------ the numbers
    def protocol(self) -> str:
        """Task, data, cases, bodies, root paths and test, and the formula of the first value."""
        data, infos = self.newest.dataset, [info for each in self.sections for info in each.infos]
        cases = (
            f"{each.split} {count(len(each.infos), 'case')} of {count(each.clip_count, 'clip')}"
            for each in self.sections
        )
        version = f", version {data.version}" if data.version else ""
        bodies = len({name for info in infos for name in (info.source, info.target)})
        rules = _alike((m.root_rule or UNKNOWN, k) for k, m in self.methods_shown.items() if not m.control)
        paths = f"; root paths scaled by {rules}" if rules and self.chapter.kind in PAIRED else ""
        tests = "paired sign flips of clips, p-values adjusted by Westfall and Young 1993, stepping down"
        main = [group.subject or column.id for group in self.groups for column in group.columns][:1]
        value = next((each for each in self.table.explained if [each.id] == main and each.formula), None)
        return (
            f"{GOALS.get(self.chapter.kind, GOAL)[:-1]}, on {data.label}{version}: {', '.join(cases)}, "
            f"{count(bodies, 'character')} in all{paths}; tests: {tests if self.marked else 'none'}."
            + (f" {value.label} [{value.unit}]: {value.formula}." if value else "")
        )

    def limits(self) -> str:
        """What does not follow from the numbers."""
        learned = {k: m for k, m in self.methods_shown.items() if m.training_share and not m.is_by_authors}
        shares = ", ".join(f"{label} {each.training_share}" for label, each in learned.items())
        sentences = {
            "Nothing follows for other characters, motion or data.": True,
            "A difference that is not significant does not mean equality.": self.marked,
            "Nothing here says which method is better.": not self.marked,
            "Rows that are not ranked may not be compared.": any(each.unranked for each in self.groups),
            "Learned methods were not trained by their papers' authors, and on this share of the papers' "
            f"windows: {shares}.": bool(shares),
        }
        return " ".join(sentence for sentence, holds in sentences.items() if holds)

    def not_shown(self) -> str:
        """Cases without an answer, and variants and values that are left out."""
        variants = dict.fromkeys(label for each in self.sections for label in each.variants)
        shown = {group.subject or column.id for group in self.groups for column in group.columns}
        others = {key for each in self.sections for key in builder.all_columns([each])} - shown
        known = (*self._speeds, *self.newest.dataset.notes)
        sentences = [
            *(f"{line}." for line in words.problem_lines(self.table) or ["No case is without an answer"]),
            *([f"Variants: {', '.join(variants)}."] if variants else []),
            *([f"{count(len(others), 'more value')} (bench table --all)."] if others else []),
            *(note for note in self.table.notes if note not in known),
        ]
        return " ".join(sentences)

    def seeds(self) -> str:
        seeds = _alike((", ".join(map(str, h.seeds)) or UNKNOWN, k) for k, h in self.headers.items())
        random = [label for label, each in self.methods_shown.items() if each.stochastic]
        return f"One run for each seed: {seeds}. Stochastic methods: {listed(random) or 'none'}."

    # -------------------------------------------------------------------------- data, training, compute
    def data(self) -> str:
        data, licence, obtain = self.newest.dataset, UNKNOWN, UNKNOWN
        with suppress(BenchError):
            built = class_card(registry.load("datasets", data.name))
            card = whole(built or bound.dataset(self.chapter.data).built.card, DatasetCard)
            licence, obtain = card.licence or UNKNOWN, card.obtain or UNKNOWN
        facts = ", ".join(f"{name} {fact}" for name, fact in self.table.data)
        unreadable = [data.unreadable.sentence] if data.unreadable else []
        text = f"{facts[0].upper()}{facts[1:]}; licence: {licence}; to get it: {obtain}."
        return " ".join([text, *data.notes, *unreadable])

    @cached_property
    def records(self) -> dict[str, Any]:
        """Learned method -> record of the training of its weights; None where those here may be others."""
        methods = self.methods_shown.items()
        return {label: _record(each) for label, each in methods if each.trained_on is not None}

    def training(self) -> str:
        """Data, windows, time and seed of weights, without those of weights that these began with."""
        texts = []
        for label, record in self.records.items():
            on, what = UNKNOWN, "windows, time and seed unknown"
            if record is not None and record.steps:
                data, batch = record.data, record.recipe.batch if record.recipe else 0
                on = f"{data.label or data.spec}, {data.clips} clips, {data.hours:.3g} h of motion"
                amount = f"{record.steps * batch:,} windows" if batch else f"{record.steps:,} steps"
                init = f" after weights {record.init[:DIGITS]}" if record.init else ""
                what = f"{amount} in {card_text.hours(record.seconds)}, seed {record.seed}{init}"
            texts.append((f"On {on}", f"{label} {what}"))
        return f"{_listed(texts) or 'None'}."

    @cached_property
    def _speeds(self) -> list[str]:
        timed = [each for each in self.sections if any(score.fps is not None for score in each.scores)]
        return speeds(timed[0]) if timed else []

    def compute(self) -> str:
        trained = _alike((each.hardware or UNKNOWN, k) for k, each in self.records.items() if each)
        run = f"Hours and processor of the run: {UNKNOWN}; its platform is under versions."
        return " ".join([run, *self._speeds, *([f"Trained on: {trained}."] if trained else [])])

    # ------------------------------------------------------------------------------ code and provenance
    def code(self) -> str:
        versions, revisions = (
            dict.fromkeys(getattr(each, name) or UNKNOWN for each in self.table.provenance)
            for name in ("versions", "revision")
        )
        names = {each.version.partition(" ")[0] for group in self.groups for each in group.columns}
        names |= {each.version.partition(" ")[0] for each in self.table.subjects}
        metrics = [f"{name} {which}" for name, which in self.newest.metrics.items() if name in names]
        dates = sorted({each.date[:10] or UNKNOWN for each in self.headers.values()})
        made = dict.fromkeys((dates[0], dates[-1]))
        return (
            f"{'; '.join(versions)}; revision {', '.join(revisions)}; "
            f"metrics {', '.join(metrics) or UNKNOWN}; results of {' to '.join(made)}. Licence of the "
            f"benchmark: {distribution.licence()}; address of its code: {distribution.address()}."
        )

    def methods(self) -> str:
        """Of every method licence, version, code and paper, and of its splits the keys and checksums."""
        texts = []
        for label, method in self.methods_shown.items():
            built = _built(method)
            licence, paper = (built.card.licence, built.card.paper) if built else ("", "")
            licence = licence or ("of the benchmark" if method.origin == registry.BUILT_IN else UNKNOWN)
            code = f"{method.version or UNKNOWN}+{method.code or UNKNOWN}"
            pairs = (_key(row.header) for each in self.sections for row in each.rows if row.label == label)
            facts = (label, code, *pairs, f"({paper})" if paper else "")
            texts.append((f"Licence {licence}", " ".join(filter(None, facts))))
        lead = f"Version+code, then split score key/SHA-256 of METHOD.csv, {DIGITS} digits each"
        several = (
            ", of the first seed" if any(len(each.seeds) > 1 for each in self.headers.values()) else ""
        )
        return f"{lead}{several}; equal keys: same code, weights, data, metrics. {_listed(texts)}."


def _key(header: ResultHeader) -> str:
    pair = header.keys.get("score_key", UNKNOWN), header.files.get("csv", UNKNOWN)
    return f"{header.split} {'/'.join(each[:DIGITS] for each in pair)}"


def _listed(pairs: Iterable[tuple[str, str]]) -> str:
    """Headings, each with all that stands under it."""
    return ". ".join(f"{heading}: {'; '.join(each)}" for heading, each in _grouped(pairs).items())


def _grouped(pairs: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    groups: dict[str, list[str]] = {}
    for key, each in pairs:
        groups.setdefault(key, []).append(each)
    return groups


def _alike(pairs: Iterable[tuple[str, str]]) -> str:
    """Facts with the methods that they are true of; a fact alone is true of all."""
    groups = _grouped(pairs)
    facts: Sequence[str] = [f"{fact} ({listed(each)})" for fact, each in groups.items()]
    return "; ".join(facts if len(groups) > 1 else groups)


def _built(method: MethodInfo) -> Method | None:
    """The method as it is here; None where it is not, or in another version."""
    with suppress(BenchError):
        built = bound.method(Spec(method.name, method.parameters)).built
        return built if built.card.version == method.version else None
    return None


def _record(method: MethodInfo) -> Any:
    """The training of a method's weights; None where those that are here may be others."""
    built = _built(method)
    with suppress(BenchError):
        seen: Mapping[str, Sequence[str]] = (built and built.training_manifest) or {}
        if seen and {name: tuple(each) for name, each in seen.items()} == method.trained_on:
            return getattr(built, "weights_card", None)
    return None
