"""Names and docstrings of the package that a reader would stumble over: `python -m tests.promises.words [FOLDER]`.

FOLDER is a folder of `src/hemline`; all of the package is read unless it is given.
"""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from tests.promises.import_graph import PACKAGE

PARTICIPLE = re.compile(
    r"(?:[a-z]{2,}ed|told|held|worn|kept|made|found|said|known|seen|gone|led|laid|drawn|blown|swung|shown|built|sent|"
    r"heard|fed|won|left|lost|bound|taken|given|chosen|written|hung|meant|sought|thrown|torn|spread|driven|risen|woven)"
)
"""The first word of a name that says what was done to something, where a verb or a noun is expected."""
NOUNS = {"speed", "bed", "need", "feed", "seed", "weed", "embed", "exceed", "proceed", "breed", "bleed", "shed", "sled"}
"""Words that only look like participles."""
ELLIPTIC = re.compile(
    r"(Of|Those|That of|The same|So many|So far|So long|So|As|Its|Their|How far|How many|What of|None|And|But|Or|Not|"
    r"Only|Also|Besides?|Likewise|Else|Otherwise)\b"
)
"""Beginnings of sentences that cannot be read alone."""
BANNED = (
    "told", "worn_by", "lively", "meeting", "leaps", "wishes", "wish", "shelf", "pace", "sor_way", "ways", "way",
    "home", "judge", "judges", "soak", "lay", "laid", "twin",
)  # fmt: skip
"""Words of a name, between underscores, that stand for an idea that the field calls otherwise."""


class Definition(ast.NodeVisitor):
    """Collects functions, classes and documented fields of one file, each with its docstring and line."""

    def __init__(self) -> None:
        self.functions: list[tuple[str, int]] = []
        self.classes: list[tuple[str, int]] = []
        self.docstrings: list[tuple[str, int, str]] = []

    def _visit_body(self, node, name: str) -> None:
        text = ast.get_docstring(node)
        if text:
            self.docstrings.append((name, getattr(node, "lineno", 1), text))
        for first, second in zip(node.body, node.body[1:], strict=False):
            text = getattr(getattr(second, "value", None), "value", None)
            if isinstance(first, ast.Assign | ast.AnnAssign) and isinstance(second, ast.Expr) and isinstance(text, str):
                target = first.target if isinstance(first, ast.AnnAssign) else first.targets[0]
                self.docstrings.append((ast.unparse(target), second.lineno, text))
        self.generic_visit(node)

    def visit_Module(self, node: ast.Module) -> None:
        self._visit_body(node, "the file")

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.classes.append((node.name, node.lineno))
        self._visit_body(node, node.name)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        self.functions.append((node.name, node.lineno))
        self._visit_body(node, node.name)


def definitions(folder: Path = PACKAGE) -> Iterator[tuple[Path, Definition]]:
    """Yields each file of a folder with what it defines."""
    for path in sorted(folder.rglob("*.py")):
        read = Definition()
        read.visit(ast.parse(path.read_text()))
        yield path, read


def participles(folder: Path = PACKAGE) -> tuple[list[str], int]:
    """Functions that are named by a participle, as file:line name, and the number of all functions."""
    hits, count = [], 0
    for path, read in definitions(folder):
        for name, line in read.functions:
            if name.startswith("__"):
                continue
            count += 1
            first = name.strip("_").split("_")[0]
            if PARTICIPLE.fullmatch(first) and first not in NOUNS:
                hits.append(f"{path.relative_to(PACKAGE)}:{line} {name}")
    return hits, count


def ellipses(folder: Path = PACKAGE) -> list[str]:
    """Docstrings that begin in the middle of a thought."""
    return [
        f"{path.relative_to(PACKAGE)}:{line} {name}: {text.splitlines()[0]}"
        for path, read in definitions(folder)
        for name, line, text in read.docstrings
        if ELLIPTIC.match(text)
    ]


def shared_names(folder: Path = PACKAGE) -> dict[str, list[str]]:
    """Names of classes that several files define; private ones too, since readers meet them in tracebacks."""
    places = defaultdict(list)
    for path, read in definitions(folder):
        for name, line in read.classes:
            places[name].append(f"{path.relative_to(PACKAGE)}:{line}")
    return {name: found for name, found in sorted(places.items()) if len(found) > 1}


def banned(folder: Path = PACKAGE) -> list[str]:
    """Functions and classes with a banned word in their names."""
    hits = []
    for path, read in definitions(folder):
        for name, line in read.functions + read.classes:
            words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower().strip("_").split("_")
            hits += [f"{path.relative_to(PACKAGE)}:{line} {name}" for word in words if word in BANNED]
    return hits


if __name__ == "__main__":
    asked = PACKAGE / sys.argv[1] if len(sys.argv) > 1 else PACKAGE
    named, count = participles(asked)
    print(f"== {len(named)} of {count} functions are named by a participle", *named, sep="\n")
    print("== docstrings that cannot be read alone", *ellipses(asked), sep="\n")
    print("== names in which a banned word stands", *banned(asked), sep="\n")
    inside = asked.relative_to(PACKAGE).as_posix()
    shared = {name: at for name, at in shared_names().items() if inside == "." or any(a.startswith(inside) for a in at)}
    print("== classes of one name", *(f"{name}: {' '.join(at)}" for name, at in shared.items()), sep="\n")
