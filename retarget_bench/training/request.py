"""The folder of a training run: the request, its defaults filled in (``run.json``), and the lock."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from retarget_bench import files
from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import LOCK, write_text
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import Budget, TrainingConfig
from retarget_bench.training.joint_datasets import joint_spec, split_spec

SCHEMA = 1
NAME = "run.json"


@dataclass(frozen=True)
class Request:
    """One run.

    method, dataset: canonical specs. content: of the data. recipe: the preset's, with the budget's steps.
    version, facts:  of the method, which its checkpoints depend on. processes: that train together.
    job:             the ``torchrun`` that trains or trained last, which goes on by itself.
    earlier:         budgets that a longer one has replaced.
    init:            hash of the weights that training began with; "": none. init_path: as they were given.
    seen:            the training manifest of those weights. seen_all: whether they are known to have seen
                     nothing else.
    motion:          hash of the motion that was gathered; "": not known.
    """

    method: str
    dataset: str
    preset: str
    budget: str
    seed: int
    recipe: TrainingConfig
    version: str
    facts: Mapping[str, Any]
    label: str
    content: str
    init: str = ""
    init_path: str = ""
    seen: Mapping[str, Sequence[str]] = dataclasses.field(default_factory=dict)
    seen_all: bool = False
    motion: str = ""
    earlier: Sequence[str] = ()
    processes: int = 1
    job: str = ""
    versions: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @property
    def limit(self) -> Budget:
        return Budget.parse(self.budget) if self.budget else Budget(steps=self.recipe.steps)

    @property
    def precision(self) -> str:
        return self.recipe.precision

    @property
    def augment(self) -> bool:
        return self.recipe.augmentation is not None

    @property
    def command(self) -> str:
        """The command that asks for this, without places of files."""
        data = split_spec(Spec.parse(without_places(self.dataset)))
        parts = ["bench train", _quoted(self.method)]
        parts += [word for each in data for word in ("-d", _quoted(str(each)))]
        parts += ["--preset", self.preset]
        parts += ["--budget", self.budget] if self.budget else []
        parts += ["--precision", self.precision] if self.precision != TrainingConfig.precision else []
        parts += ["--augment"] if self.augment else []
        parts += ["--init", "WEIGHTS"] if self.init else []
        return " ".join([*parts, "--seed", str(self.seed)])


def without_places(dataset: str) -> str:
    """The spec of a data set, or of several, without where their files lie."""
    return str(
        joint_spec(
            [Spec(each.name, bound.dataset(each).parameters) for each in split_spec(Spec.parse(dataset))]
        )
    )


def _quoted(text: str) -> str:
    return f"'{text}'" if "[" in text else text


def write(folder: Path, request: Request) -> None:
    """Raises FileError."""
    facts = {"schema": SCHEMA, "command": request.command, **asdict(request)}
    write_text(folder / NAME, json.dumps(facts, indent=1, ensure_ascii=False) + "\n")


def read(folder: Path) -> Request | None:
    """The run that a folder holds; None: it holds none. Raises FileError."""
    from pydantic import TypeAdapter, ValidationError

    path = folder / NAME
    try:
        facts = dict(json.loads(path.read_text(encoding="utf-8")))
        if facts.pop("schema") != SCHEMA:
            raise FileError(path, f"is of a format that this version does not read (it reads {SCHEMA})")
        facts.pop("command")
        Request(**facts | {"recipe": TrainingConfig(**facts["recipe"])})  # no other fields
        return TypeAdapter(Request).validate_json(json.dumps(facts), strict=True)
    except FileNotFoundError:
        return None
    except ValidationError as error:
        odd = error.errors()[0]
        where = ".".join(map(str, odd["loc"]))
        raise FileError(path, f"does not describe a training run ({where}: {odd['msg']})") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(path, f"does not describe a training run ({error})") from error


def contradicted(earlier: Request, options: Mapping[str, object]) -> None:
    """Raises BenchError where an option that was given (is not None) differs from the run's."""
    for name, value in options.items():
        before = getattr(earlier, name)
        if value is not None and value != before:
            begun = f"{name} {before}" if before != "" else f"no {name}"
            raise BenchError(
                f"this run began with {begun}, not {value}; leave the option out to go on with it, or give "
                "another --out to begin another run"
            )


def locked(folder: Path) -> AbstractContextManager[None]:
    """The folder for this process alone: see ``files.locked``."""
    return files.locked(folder / LOCK, f"another process is training in {folder}")
