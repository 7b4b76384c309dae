"""Specs, the written form of a plug-in and its parameters: ``copy_rotations[root_rule=height,scale=1.5]``.

The grammar::

    spec        = plugin [ "@" environment ] { "+" plugin }
    plugin      = name [ "[" pair { "," pair } "]" ]
    pair        = key "=" value
    value       = true | false | integer | number | text | "quoted text" | 'quoted text'
    environment = word | "quoted text" | 'quoted text'

Bare text ends at a comma or a closing bracket; spaces around it do not count. Text that holds one of
these, a quote or an equals sign, or that would read as a number or a truth value, is quoted; in quotes
a backslash makes the next quote or backslash an ordinary character and is itself ordinary before
anything else. A plus sign outside brackets belongs to no name: what follows it are post-processors, which
work on the answers of the method before them, in this order.

An environment is the Python that answers in place of this one: its path, a command that starts it
(``pan@"docker run -i image python"``), or, in results, the version and lock hash that it goes by
(``pan@python3.10-3f2a91c0``).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from retarget_bench import files
from retarget_bench.errors import BenchError

Scalar = str | int | float | bool

LONGEST_NAME = 50
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_INTEGER = re.compile(r"[+-]?(0|[1-9][0-9]*)")
_NUMBER = re.compile(r"[+-]?((0|[1-9][0-9]*)(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")
"""``007`` and ``00.5`` are names of something, not numbers."""
_TRUTH = {"true": True, "True": True, "false": False, "False": False}
_BARE = re.compile(r"[^\s\[\],='\"]([^\[\],='\"]*[^\s\[\],='\"])?")
_WORD = re.compile(r"[^\s\[\],+='\"]+")
_WRITTEN = "it is written name[parameter=value,parameter=value], a post-processor behind it as +name[...]"
_QUOTED = re.compile(r"\"((?:\\.|[^\"\\])*)\"|'((?:\\.|[^'\\])*)'", re.DOTALL)


def folded(name: str) -> str:
    """A name without case, spaces, underscores and hyphens, which people write differently."""
    return re.sub(r"[\s_-]", "", name.casefold())


@dataclass(frozen=True, eq=False)
class Spec:
    """A plug-in's name and parameters, as they are written.

    posts: the post-processors of a method, in their order; they have none of their own.
    environment: where a method answers, as it is written; "": here.

    Two are equal when they are written alike: ``a[n=1]``, ``a[n=1.0]`` and ``a[n=true]`` differ.
    """

    name: str
    parameters: Mapping[str, Scalar] = field(default_factory=dict)
    posts: tuple[Spec, ...] = ()
    environment: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", dict(sorted(self.parameters.items())))

    @classmethod
    def parse(cls, text: str | Spec) -> Spec:
        """Read a spec; raises BenchError with the place of the mistake. A Spec is returned as it is."""
        return text if isinstance(text, Spec) else _Reader(text).spec()

    def with_parameters(self, **parameters: Scalar) -> Spec:
        """The same plug-in with these parameters set on top of its own."""
        return replace(self, parameters={**self.parameters, **parameters})

    @property
    def alone(self) -> Spec:
        """The method without its post-processors and its environment."""
        return Spec(self.name, self.parameters)

    @property
    def here(self) -> Spec:
        """The method without its environment."""
        return replace(self, environment="")

    @property
    def names(self) -> str:
        """Without parameters: ``pan+footfix``."""
        return "+".join((self.name, *(post.name for post in self.posts)))

    @property
    def slug(self) -> str:
        """A file name: the plug-in's name, and eight hex digits of its parameters where it has some, or of
        everything where it has post-processors or an environment."""
        if not (self.parameters or self.posts or self.environment):
            return files.slug(self.name)
        facts = [[post.name, post.parameters] for post in self.posts]
        content: object = [self.parameters, *facts] if facts else self.parameters
        if self.environment:
            content = {"environment": self.environment, "method": content}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
        name = "-".join((*self.names.split("+"), *filter(None, [self.environment])))
        return f"{files.slug(name)[:LONGEST_NAME]}-{files.digest(text)}"

    def __str__(self) -> str:
        """The canonical form, parameters sorted by name; ``Spec.parse`` of it is this spec again."""
        pairs = [f"{key}={write_value(value)}" for key, value in self.parameters.items()]
        own = f"{self.name}[{','.join(pairs)}]" if pairs else self.name
        if self.environment:
            word = _WORD.fullmatch(self.environment)
            own += f"@{self.environment if word else _quoted(self.environment)}"
        return "+".join((own, *map(str, self.posts)))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Spec) and str(self) == str(other)

    def __hash__(self) -> int:
        return hash(str(self))


def read_parameters(text: str, written: str) -> dict[str, Scalar]:
    """``[key=value,key=value]`` by key. written: how it is written, for errors. Raises BenchError with the
    place of the mistake."""
    return _Reader(text, written).parameters()


def read_value(text: str) -> Scalar:
    """The value that bare text stands for: a truth value, an integer, a number, else itself."""
    if text in _TRUTH:
        return _TRUTH[text]
    if _INTEGER.fullmatch(text):
        return int(text) if len(text) < 400 else text
    if _NUMBER.fullmatch(text) and math.isfinite(float(text)):
        return float(text)
    return text


def write_value(value: Scalar) -> str:
    """The text that reads as ``value`` again; quoted only where it must be."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if _BARE.fullmatch(value) and isinstance(read_value(value), str):
        return value
    return _quoted(value)


def _quoted(text: str) -> str:
    escaped = re.sub(r'(["\\])', r"\\\1", text)
    return f'"{escaped}"'


class _Reader:
    """Reads one spec from left to right."""

    def __init__(self, text: str, written: str = _WRITTEN) -> None:
        self.text = text.strip()
        self.written = written
        self.at = 0

    def parameters(self) -> dict[str, Scalar]:
        """All of the text, in brackets."""
        parameters = self._parameters() if self._take("[") else {}
        if self.at < len(self.text):
            raise self._error("the end" if parameters else "'['")
        return parameters

    def spec(self) -> Spec:
        first, posts = self._plugin(), list[Spec]()
        if self._take("@"):
            first = replace(first, environment=self._environment())
            if not first.environment.strip():
                raise BenchError(
                    f"{self.text}: nothing follows @; name a Python, or a command that starts one"
                )
        while self._take("+"):
            posts.append(self._plugin())
        if self.at < len(self.text):
            last = posts[-1] if posts else first
            raise self._error("'+' or the end" if last.parameters else "'[', '+' or the end")
        return replace(first, posts=tuple(posts))

    def _plugin(self) -> Spec:
        name = self._match(NAME, "a name such as copy_rotations")[0]
        if len(name) > LONGEST_NAME:
            raise BenchError(f"{name!r} is longer than the {LONGEST_NAME} characters a name may have")
        return Spec(name, self._parameters() if self._take("[") else {})

    def _parameters(self) -> dict[str, Scalar]:
        parameters: dict[str, Scalar] = {}
        while not self._take("]"):
            if parameters and not self._take(","):
                raise self._error("',' or ']'")
            key = self._match(_KEY, "a parameter's name")[0]
            if key in parameters:
                raise BenchError(f"{self.text}: parameter {key!r} is given twice")
            if not self._take("="):
                raise self._error(f"'=' after {key}")
            parameters[key] = self._value(key)
        return parameters

    def _value(self, key: str) -> Scalar:
        if self._at_quote():
            return self._unquoted(key)
        return read_value(self._match(_BARE, f"a value for {key} (quote text that holds ,=[]'\")")[0])

    def _environment(self) -> str:
        if self._at_quote():
            return self._unquoted("the environment")
        return self._match(_WORD, "a Python (quote a command that holds spaces or +,=[]'\")")[0]

    def _at_quote(self) -> bool:
        self._spaces()
        return self.text[self.at : self.at + 1] in ("'", '"')

    def _unquoted(self, what: str) -> str:
        quoted = self._match(_QUOTED, f"the closing quote of {what}")
        inside = quoted[1] if quoted[1] is not None else quoted[2]
        return re.sub(r"\\(['\"\\])", r"\1", inside)

    def _match(self, pattern: re.Pattern[str], expected: str) -> re.Match[str]:
        self._spaces()
        match = pattern.match(self.text, self.at)
        if match is None:
            raise self._error(expected)
        self.at = match.end()
        return match

    def _take(self, character: str) -> bool:
        self._spaces()
        if self.text.startswith(character, self.at):
            self.at += 1
            return True
        return False

    def _spaces(self) -> None:
        while self.text[self.at : self.at + 1].isspace():
            self.at += 1

    def _error(self, expected: str) -> BenchError:
        actual = repr(self.text[self.at]) if self.at < len(self.text) else "the end"
        where = f"{self.text or 'an empty name'}: expected {expected} at character {self.at + 1}"
        return BenchError(f"{where}, found {actual}; {self.written}")
