"""Tables drawn: as text, Markdown, LaTeX, HTML, CSV or JSON. Every renderer gets the same ``Table``."""

from collections.abc import Callable, Sequence
from functools import partial

from retarget_bench.tables.model import Table
from retarget_bench.tables.rendering.as_data import comma_separated as comma_separated
from retarget_bench.tables.rendering.as_data import json_document
from retarget_bench.tables.rendering.as_html import html as html
from retarget_bench.tables.rendering.as_latex import latex as latex
from retarget_bench.tables.rendering.as_markdown import markdown as markdown
from retarget_bench.tables.rendering.as_text import WIDTH as WIDTH
from retarget_bench.tables.rendering.as_text import text as text

Renderer = Callable[[Sequence[Table]], str]
"""Tables to one document."""

RENDERERS: dict[str, Renderer] = {
    "text": text,
    "md": markdown,
    "tex": latex,
    "html": html,
    "csv": comma_separated,
    "json": json_document,
}
WITH_INTERVALS: dict[str, Renderer] = RENDERERS | {
    "text": partial(text, intervals=True),
    "md": partial(markdown, intervals=True),
    "tex": partial(latex, intervals=True),
}
"""The other formats always hold intervals."""
