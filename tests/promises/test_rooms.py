"""Imports point one way: the order of the rooms in docs/design.md, read from the source itself."""

import ast
from itertools import pairwise

import pytest

from tests.promises.import_graph import PACKAGE, circles, files, imports, name_of

ORDER = [
    {"errors", "arrays", "compiled", "access", "files", "options", "version"},
    {"meshes", "motions"},
    {"bodies"},
    {"garments"},
    {"collide", "springs"},
    {"datasets", "learning"},
    {"sim"},
    {"animators"},
    {"tryon"},
    {"metrics", "pictures", "export"},
    {"playback"},
    {"bench", "make", "models", "study", "view", "web"},
    {"cli", "__main__"},
]
"""Rooms, from left to right; rooms in one set do not import each other."""
BESIDE = {
    ("files", "errors"),
    ("access", "errors"),
    ("options", "errors"),
    ("compiled", "errors"),
    ("compiled", "files"),
    ("export", "pictures"),
    ("files", "arrays"),
    ("__main__", "cli"),
}
"""Pairs in one set of which the first may import the second."""
INNER = {
    "sim": ["settings", "cloth", "solver", "contact", "step", "small_steps", "rest", "takes"],
    "collide": ["primitives", "winding", "surface", "whole", "cover", "projection", "close", "layers", "neural_sdf"],
}
"""Rooms inside a room, from left to right; its `__init__` is the door to all of them."""
ARRAYS_ONLY = {"metrics", "pictures", "export"}
CLIPS_ONLY = {"study"}
"""Rooms that see files of clips only."""
SHARED = "coarse"
"""What animators share that move a coarse garment by a network; it imports none of them."""
FROM_SIM = {
    f"animators/{room}"
    for room in ("live", "coarse", "simulated_proxy", "newton_solver", "small_step_solver", "proxy_solver", "settle")
}
"""Animators whose garments settle, or move, by the simulator while they are prepared or shown, and what they share."""
LEVEL = {room: level for level, rooms in enumerate(ORDER) for room in rooms}
FILES = files()


def parts(file) -> tuple[str, ...]:
    return file.relative_to(PACKAGE).with_suffix("").parts


def room_of(file) -> str:
    return parts(file)[0]


def by_name(name: str):
    return PACKAGE / name


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_rooms_import_only_what_stands_to_their_left(file):
    room = room_of(file)
    if room == "__init__":
        return
    assert room in LEVEL, f"room '{room}' is not in docs/design.md"
    for other in {room_of(each) for each in imports(file)} - {room}:
        assert other != "__init__", f"{name_of(file)} imports the root of the package: name the room instead"
        assert LEVEL[other] < LEVEL[room] or (room, other) in BESIDE, (
            f"{name_of(file)} imports '{other}', which does not stand to the left of '{room}'"
        )
        if room in ARRAYS_ONLY:
            assert LEVEL[other] == 0 or other in ARRAYS_ONLY | {"meshes", "springs"}, (
                f"'{room}' sees arrays only; {name_of(file)} imports '{other}'"
            )
        if room in CLIPS_ONLY:
            assert other in ("access", "errors", "files"), (
                f"'{room}' sees files of clips only; {name_of(file)} imports '{other}'"
            )
        if (room, other) == ("animators", "sim"):
            assert "/".join(parts(file)[:2]) in FROM_SIM, f"{name_of(file)} imports 'sim': only {FROM_SIM} may"


@pytest.mark.parametrize("file", [file for file in FILES if room_of(file) in INNER], ids=name_of)
def test_rooms_inside_rooms_do_the_same(file):
    order = INNER[room_of(file)]
    inside = parts(file)[1]
    if inside == "__init__":
        return
    assert inside in order, f"{name_of(file)}: name it in docs/design.md, or move it into a room"
    for other in imports(file):
        if room_of(other) == room_of(file):
            within = parts(other)[1]
            assert within != "__init__", f"{name_of(file)} goes out by the front door: import the file itself"
            assert order.index(within) <= order.index(inside), f"{name_of(file)} imports '{within}', to its right"


def test_no_two_files_import_each_other_in_a_circle():
    assert circles() == []


def test_animators_do_not_import_each_other():
    for file in FILES:
        if room_of(file) != "animators" or len(parts(file)) < 3:
            continue
        for other in imports(file):
            if room_of(other) == "animators" and len(parts(other)) > 2:
                shared = parts(other)[1] == SHARED
                assert shared or parts(other)[1] == parts(file)[1], f"{name_of(file)} imports {name_of(other)}"


def test_the_reader_of_imports_sees_what_there_is():
    play = {name_of(each) for each in imports(by_name("playback/play.py"))}
    assert "bodies/body.py" in play  # at the top of the file
    fit = {name_of(each) for each in imports(by_name("cli/verbs/fit.py"))}
    assert "datasets/__init__.py" in fit  # within a function
    door = {name_of(each) for each in imports(by_name("sim/__init__.py"))}
    assert "sim/step/stepper.py" in door  # of an __init__, relative
    assert {room_of(a) != room_of(b) for a, b in pairwise(FILES)} == {True, False}


def fits(file) -> bool:
    """Whether a file lies where networks are trained and shipped files made; torch lives there alone."""
    return "fit" in parts(file)[:-1] or parts(file)[:2] == ("models", "make")


@pytest.mark.parametrize("file", [file for file in FILES if not fits(file)], ids=name_of)
def test_what_plays_imports_nothing_that_fits(file):
    fitting = [name_of(other) for other in imports(file, at_the_top=True) if fits(other)]
    assert not fitting, f"{name_of(file)} imports {fitting} when it is imported"


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_numba_is_imported_through_one_door(file):
    text = file.read_text()
    direct = [line for line in text.splitlines() if line.startswith(("import numba", "from numba"))]
    assert not direct or room_of(file) == "compiled", f"{file.name}: import kernel from hemline.compiled instead"


def test_stems_of_kernel_files_differ():
    stems = [file.stem for file in PACKAGE.rglob("*kernels.py")]
    assert len(stems) == len(set(stems))


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_nothing_unpickles_and_nothing_prints_outside_the_cli(file):
    """Modules of `models/make` and `bench/body` are run with `python -m`.

    Numba pickles machine code; `compiled/cache.py` reads what a process of this user wrote, see `compiled/folder.py`.
    """
    talks = room_of(file) in ("cli", "models") or name_of(file) == "bench/body.py"
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            own = (name_of(file), name) == ("compiled/cache.py", "pickle.loads")
            assert own or name not in ("pickle.load", "pickle.loads", "eval", "exec"), f"{file.name}: {name}"
            assert name != "print" or talks, f"{file.name} prints"
            for keyword in node.keywords:
                assert ast.unparse(keyword) != "allow_pickle=True", file.name
