"""Imports point one way: the order of the rooms in docs/design.md, read from the source itself."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "src" / "hemline"
LEVELS = [
    {"errors", "arrays", "compiled", "files"},
    {"meshes", "motions"},
    {"bodies"},
    {"garments", "collide"},
    {"datasets"},
    {"sim", "animators"},
    {"tryon"},
    {"metrics", "pictures", "export"},
    {"playback"},
    {"cli", "__main__"},
]
LEVEL = {room: level for level, rooms in enumerate(LEVELS) for room in rooms}
ARRAYS_ONLY = {"metrics", "pictures", "export"}
KINDLY_APART = [{"sim", "animators"}]
FILES = sorted(PACKAGE.rglob("*.py"))


def room_of(file: Path) -> str:
    relative = file.relative_to(PACKAGE)
    return relative.parts[0] if len(relative.parts) > 1 else relative.stem


def imported_rooms(file: Path) -> set[str]:
    found = set()
    package = ("hemline", *file.relative_to(PACKAGE).parts[:-1])
    for node in ast.walk(ast.parse(file.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            stem = ".".join(part for part in (base, node.module or "") if part)
            names = [f"{stem}.{alias.name}" for alias in node.names]
        found |= {name.split(".")[1] for name in names if name.startswith("hemline.") and name.count(".") >= 1}
    return found & set(LEVEL)


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.relative_to(PACKAGE)))
def test_rooms_import_only_what_stands_to_their_left(file):
    room = room_of(file)
    if room == "__init__":
        return
    assert room in LEVEL, f"room '{room}' is not in docs/design.md"
    for other in imported_rooms(file) - {room}:
        assert LEVEL[other] <= LEVEL[room], f"{file.name} in '{room}' imports '{other}', which stands to its right"
        assert {room, other} not in KINDLY_APART, f"'{room}' and '{other}' never import each other"
        if room in ARRAYS_ONLY:
            assert LEVEL[other] == 0 or other in ARRAYS_ONLY | {"meshes"}, (
                f"'{room}' sees arrays only; {file.name} imports '{other}'"
            )


def test_the_reader_of_imports_sees_them():
    assert "bodies" in imported_rooms(PACKAGE / "playback" / "play.py")
    assert {"datasets", "garments"} <= imported_rooms(PACKAGE / "sim" / "produce.py")


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.relative_to(PACKAGE)))
def test_numba_is_imported_through_one_door(file):
    text = file.read_text()
    direct = [line for line in text.splitlines() if line.startswith(("import numba", "from numba"))]
    assert not direct or file.name == "compiled.py", f"{file.name}: import kernel from hemline.compiled instead"


def test_stems_of_kernel_files_differ():
    stems = [file.stem for file in PACKAGE.rglob("*kernels.py")]
    assert len(stems) == len(set(stems))


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.relative_to(PACKAGE)))
def test_nothing_unpickles_and_nothing_prints_outside_the_cli(file):
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            assert name not in ("pickle.load", "pickle.loads", "eval", "exec"), f"{file.name}: {name}"
            assert name != "print" or "cli" in file.parts or file.stem in COMMANDS, f"{file.name} prints"
            for keyword in node.keywords:
                assert ast.unparse(keyword) != "allow_pickle=True", file.name


COMMANDS = {"bake", "excerpts"}
"""Modules that are run with `python -m` to make what ships."""
