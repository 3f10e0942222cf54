"""README and docs, taken apart: fenced blocks, inline code, links."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CONVENTIONS.md", "integrations/blender/README.md")),
    *sorted((ROOT / "docs").glob("*.md")),
    *TUTORIALS,
]
FENCE = re.compile(r"^```(\w*)[^\n`]*\n(.*?)^```", re.MULTILINE | re.DOTALL)
"""A fenced block: its language, its text; what may stand after the language is dropped."""


def blocks(page: Path, language: str) -> list[str]:
    """Fenced blocks of one language; "" are those without a name."""
    return [text for name, text in FENCE.findall(page.read_text()) if name == language]


def commands(page: Path) -> list[list[str]]:
    """Words of each line of a fenced block, and each inline code, that begins with a program we know; no comments."""
    text = page.read_text()
    lines = [line for name, block in FENCE.findall(text) if name in ("", "sh") for line in block.splitlines()]
    lines += re.findall(r"(?<!`)`([^`\n]+)`(?!`)", FENCE.sub("", text))
    known = [line.partition(" #")[0] for line in lines if re.match(r"(hemline|make|python) [\w-]", line)]
    return [shlex.split(line) for line in known]


def links(page: Path) -> list[str]:
    """Targets of relative links and pictures."""
    found = re.findall(r"\]\(([^)\s]+)\)", FENCE.sub("", page.read_text()))
    return [target for target in found if "://" not in target]


def anchors(page: Path) -> set[str]:
    """What headings of a page are called in links."""
    heads = re.findall(r"^#+ (.+)$", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", head.lower()).strip().replace(" ", "-") for head in heads}
