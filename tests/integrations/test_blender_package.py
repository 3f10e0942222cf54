"""The extension without Blender: manifest, modules, and what they say of hemline."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

import hemline
from hemline import motions
from hemline.animators import Windy, load, shipped_models
from hemline.cli import main
from hemline.garments import MATERIALS

SOURCE = Path(__file__).parents[2] / "integrations" / "blender" / "hemline"
MODULES = sorted(SOURCE.glob("*.py"))
TREES = {path.name: ast.parse(path.read_text(), path.name) for path in MODULES}
LINES_MAX = 150


def manifest() -> dict:
    return tomllib.loads((SOURCE / "blender_manifest.toml").read_text())


def imported(tree: ast.Module) -> set[str]:
    """Names of the packages that a module imports; "" is its own."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add("" if node.level else str(node.module).partition(".")[0])
    return names


def test_the_manifest_states_the_version_of_hemline_and_a_known_licence():
    content = manifest()
    assert content["schema_version"] == "1.0.0" and content["id"] == SOURCE.name and content["type"] == "add-on"
    assert content["version"] == hemline.__version__
    assert content["license"] == ["SPDX:Apache-2.0"]
    assert content["blender_version_min"] == "4.2.0"


def test_permissions_are_those_that_blender_knows_and_the_code_needs():
    assert list(manifest()["permissions"]) == ["files"]
    network = {"http", "requests", "socket", "ssl", "urllib"}
    assert not network & set().union(*map(imported, TREES.values()))


def test_modules_need_blender_numpy_and_python_alone():
    allowed = {"", "bpy", "numpy", *sys.stdlib_module_names}
    assert set().union(*map(imported, TREES.values())) <= allowed


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.name)
def test_modules_are_small_and_say_what_they_are(path):
    assert len(path.read_text().splitlines()) <= LINES_MAX
    assert ast.get_docstring(TREES[path.name])


def words_of(function: str) -> set[str]:
    """Flags in a function of the extension, besides those that are the same for all commands."""
    nodes = [node for tree in TREES.values() for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    (node,) = (node for node in nodes if node.name == function)
    words = {str(each.value) for each in ast.walk(node) if isinstance(each, ast.Constant)}
    return {word for word in words if re.match("--[a-z]", word)}


@pytest.mark.parametrize(
    "verb, functions",
    [
        ("animate", ("animate_words", "body_words", "wind_words", "start_playing")),
        ("tryon", ("try_on_words", "body_words", "start_try_on")),
    ],
)
def test_flags_that_the_extension_gives_exist(verb, functions, capsys):
    given = set().union(*map(words_of, functions))
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    known = set(re.findall(r"--[a-z-]+", capsys.readouterr().out))
    assert {"--output", "--betas"} <= given <= known


def constants(name: str) -> dict:
    """Values of the names that a module sets."""
    nodes = [
        node for node in TREES[name].body if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
    ]
    return {node.targets[0].id: ast.literal_eval(node.value) for node in nodes}


def test_names_that_the_extension_tells_are_those_of_hemline():
    nodes = {
        node.target.id: node.annotation
        for node in ast.walk(TREES["settings.py"])
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
    }

    def description(name: str) -> str:
        keywords = {each.arg: each.value for each in nodes[name].keywords}
        return ast.literal_eval(keywords["description"])

    of_any = re.search(r"; ([a-z, ]+) and ([a-z]+) play any garment", description("model"))
    shipped = re.search(r"shipped one: (.*?);", description("model"))[1].split(", ")
    assert {*shipped, *of_any[1].split(", "), of_any[2]} == set(shipped_models())
    assert constants("program.py")["OF_ONE_GARMENT"] == tuple(shipped)
    calm = {name for name in shipped_models() if not isinstance(load(name), Windy)}
    assert set(constants("program.py")["OF_CALM_AIR"]) == calm
    assert set(re.search(r"shipped one: (.*)", description("motion"))[1].split(", ")) == set(motions.names())
    assert set(constants("settings.py")["MATERIALS"]) == set(MATERIALS)
