"""README.md: short, and true of the Makefile and of the files that it points to."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = (
    *("README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "results/README.md"),
    *("docs/commands.md", "docs/writing_a_learned_method.md"),
)


def test_it_is_short():
    assert len(README.splitlines()) <= 145


def test_its_two_commands_are_targets_of_the_makefile():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
    made = [line for block in blocks for line in block.splitlines() if line.startswith("make ")]
    assert made == ["make bench", "make test"]
    for line in made:
        assert re.search(rf"^{line.split()[1]}:", makefile, re.MULTILINE)


def test_the_picture_is_light():
    (path,) = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README)
    assert (ROOT / path).stat().st_size < 300_000


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_to_files_and_headings(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in target:
            continue
        path, _, heading = target.partition("#")
        there = (ROOT / page).parent / path if path else ROOT / page
        assert there.exists(), f"{page} links to {target}"
        if heading:
            lines = re.findall(r"^#+ (.*)$", there.read_text(encoding="utf-8"), re.MULTILINE)
            assert heading in {re.sub(r"[^\w\- ]", "", line).lower().replace(" ", "-") for line in lines}
