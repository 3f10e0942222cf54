"""The imports of the package as a graph of files, read from the source; nothing is imported."""

import ast
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "src" / "hemline"


def files() -> list[Path]:
    """All Python files of the package."""
    return sorted(PACKAGE.rglob("*.py"))


def name_of(file: Path) -> str:
    """Path below the package, `sim/step/stepper.py`."""
    return file.relative_to(PACKAGE).as_posix()


@cache
def imports(file: Path, *, at_the_top: bool = False) -> frozenset[Path]:
    """Files of the package that a file imports: at its top, within a function or for type checkers; or at its top only.

    `from .room import name` is the file `room/name.py` where there is one, else `room.py` or `room/__init__.py`.
    """
    found: set[Path] = set()
    tree = ast.parse(file.read_text())
    for node in tree.body if at_the_top else ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {_file_of(alias.name.split(".")) for alias in node.names if alias.name.split(".")[0] == "hemline"}
        elif isinstance(node, ast.ImportFrom):
            base = ["hemline", *file.relative_to(PACKAGE).parts[:-1]]
            stem = base[: len(base) - node.level + 1] if node.level else []
            stem = stem + (node.module.split(".") if node.module else [])
            if stem[0] == "hemline":
                found |= {_file_of([*stem, alias.name]) for alias in node.names}
    return frozenset(found - {file})


def _file_of(parts: list[str]) -> Path:
    """The file of a dotted name, whose last part may be a name within it."""
    whole = PACKAGE.joinpath(*parts[1:])
    for path in (whole.with_suffix(".py"), whole / "__init__.py", whole.parent.with_suffix(".py")):
        if path.exists() and path != PACKAGE.with_suffix(".py"):
            return path
    return whole.parent / "__init__.py"


def circles() -> list[list[str]]:
    """Groups of files that import each other, directly or not: strongly connected components of more than one."""
    order: list[Path] = []
    seen: set[Path] = set()

    def visit(file: Path, edges: dict[Path, set[Path]], into: list[Path]) -> None:
        stack = [(file, iter(sorted(edges[file])))]
        seen.add(file)
        while stack:
            at, rest = stack[-1]
            following = next((other for other in rest if other not in seen), None)
            if following is None:
                into.append(at)
                stack.pop()
            else:
                seen.add(following)
                stack.append((following, iter(sorted(edges[following]))))

    forward = {file: set(imports(file)) for file in files()}
    backward: dict[Path, set[Path]] = {file: set() for file in forward}
    for file, others in forward.items():
        for other in others:
            backward[other].add(file)
    for file in forward:
        if file not in seen:
            visit(file, forward, order)
    seen.clear()
    groups: list[list[Path]] = []
    for file in reversed(order):
        if file not in seen:
            groups.append([])
            visit(file, backward, groups[-1])
    return [sorted(name_of(file) for file in group) for group in groups if len(group) > 1]
