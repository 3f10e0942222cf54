"""Rooms promise what can be imported, and public functions say what their arrays hold."""

import ast
import importlib
import inspect
import re

import pytest

import hemline
from tests.promises.import_graph import PACKAGE

ROOMS = sorted(path.parent.name for path in PACKAGE.glob("*/__init__.py") if "__all__" in path.read_text())
UNIT = re.compile(
    r"\[(m|mm|s|ms|kg|N|rad|deg|1/|W|J|%)[^\]]*\]|\[1\]"
    r"|\b(metres?|seconds?|milliseconds|millimetres|percent|degrees|radians|unit of|0 to 1)\b"
    r"|\b(ind(ex|ices)|ids?|numbers?|count(ed)?|triangles?|directions?|quaternions?|winding|whether|which|pictures?|sRGB|betas|normals?)\b",
    re.IGNORECASE,
)
"""What tells a reader what a number in an array means: a unit, or that it counts, points to something or chooses."""


def public(room: str) -> list[tuple[str, object]]:
    """Functions of a room, and methods and classes of it, that its `__all__` names."""
    module = importlib.import_module(f"hemline.{room}")
    found = []
    for name in module.__all__:
        value = getattr(module, name)
        if inspect.isfunction(value) or inspect.isclass(value):
            found.append((f"{room}.{name}", value))
        if inspect.isclass(value):
            members = {key: each for key, each in vars(value).items() if not key.startswith("_")}
            for key, each in members.items():
                function = getattr(each, "__func__", getattr(each, "fget", each))
                if inspect.isfunction(function) and function.__module__.startswith("hemline"):
                    found.append((f"{room}.{name}.{key}", function))
    return found


PUBLIC = [each for room in ROOMS for each in public(room)]


def test_the_package_promises_what_can_be_imported():
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    (block,) = [node for node in tree.body if isinstance(node, ast.If)]
    shown = {alias.asname for line in block.body if isinstance(line, ast.ImportFrom) for alias in line.names}
    assert {*shown, "__version__"} == set(hemline.__all__) == set(dir(hemline))
    for name in hemline.__all__:
        assert getattr(hemline, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = hemline.nothing


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_promise_what_they_import_and_define(room):
    body = ast.parse((PACKAGE / room / "__init__.py").read_text()).body
    imported = {alias.asname for node in body if isinstance(node, ast.ImportFrom) for alias in node.names}
    defined = {node.name for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    module = importlib.import_module(f"hemline.{room}")
    assert set(module.__all__) == {name for name in imported | defined if name and not name.startswith("_")}
    assert len(module.__all__) == len(set(module.__all__))
    for name in module.__all__:
        assert getattr(module, name) is not None


@pytest.mark.parametrize("name, value", PUBLIC, ids=[name for name, _ in PUBLIC])
def test_what_is_public_is_described(name, value):
    assert (value.__doc__ or "").strip() and not value.__doc__.startswith(f"{value.__name__}("), (
        f"{name}: say what it is"
    )


def takes_arrays(value) -> bool:
    """Whether arguments or result of a function are arrays with a shape."""
    return inspect.isfunction(value) and "jaxtyping" in str(inspect.signature(value))


ANY_UNIT = ("learning.",)
"""Rooms whose arrays have the unit of what they are given."""
ARRAYS = [each for each in PUBLIC if takes_arrays(each[1]) and not each[0].startswith(ANY_UNIT)]


@pytest.mark.parametrize("name, value", ARRAYS, ids=[name for name, _ in ARRAYS])
def test_functions_of_arrays_tell_units(name, value):
    assert UNIT.search(value.__doc__), f"{name}: say in which unit its arrays are, or what their numbers stand for"
