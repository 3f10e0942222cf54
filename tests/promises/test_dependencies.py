"""pyproject, its pins, docs/dependencies.md and the imports of the package name the same libraries."""

import ast
import re
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import hemline
from tests.promises.import_graph import files

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
ROWS = re.findall(r"^\| ([\w.-]+) \| ([^|]+) \|", (ROOT / "docs/dependencies.md").read_text(), re.MULTILINE)[1:]
MODULES = {"dracopy": "DracoPy", "libigl": "igl", "usd-core": "pxr", "pillow": "PIL"}
"""Names of modules that differ from those of their packages."""
TOOLS = {"pytest", "pytest-xdist", "pyright", "ruff", "pre-commit", "mkdocs-material", "mkdocstrings-python"}
"""Run as programs; all but pytest are imported by nobody."""


BROUGHT = {"triton": "torch"}
"""Packages that one of ours brings where it can use them; a single file imports each, and nothing needs that file."""


def normal(name: str) -> str:
    """A package's name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def asked() -> dict[str, str]:
    """Packages of pyproject, each with its extra or `base`."""
    extras = {"base": PROJECT["dependencies"]} | PROJECT["optional-dependencies"]
    return {normal(Requirement(line).name): extra for extra, lines in extras.items() for line in lines}


def imported(paths) -> dict[str, set[Path]]:
    """Modules that are no part of Python and not ours, each with the files that import it."""
    found: dict[str, set[Path]] = {}
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text())):
            names = [each.name for each in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module and not node.level else []
            for name in (name.split(".")[0] for name in names):
                if name not in sys.stdlib_module_names and name != "hemline":
                    found.setdefault(name, set()).add(path)
    return found


def test_every_dependency_is_imported():
    ours = imported([path for folder in ("tests", "benchmarks", "papers") for path in (ROOT / folder).rglob("*.py")])
    package = imported(files())
    for name, extra in asked().items():
        module = MODULES.get(name, name.replace("-", "_"))
        if name not in TOOLS:
            found = ours if extra == "dev" else package
            assert module in found, f"nothing imports {name}: take it out of pyproject.toml"


def test_every_import_is_a_dependency():
    modules = {MODULES.get(name, name.replace("-", "_")) for name, extra in asked().items() if extra != "dev"}
    apart = {name for name, extra in ROWS if extra == "none"}
    for module, paths in imported(files()).items():
        if module in BROUGHT:
            assert BROUGHT[module] in modules and {path.name for path in paths} == {"ring_attention.py"}
        elif module in apart:
            assert all("make" in path.parts for path in paths), f"{module} is imported outside of models/make"
        else:
            assert module in modules, f"{module} is imported by {paths}: name it in pyproject.toml"


def test_all_pages_tell_the_same_version():
    cited = re.findall(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited == [PROJECT["version"]] == [hemline.__version__]


def test_the_page_lists_what_pyproject_asks_for():
    page = {name: extra.strip("` ") for name, extra in ROWS}
    assert {name: extra for name, extra in page.items() if extra != "none"} == asked()


def pinned() -> dict[str, Requirement]:
    """What constraints.txt pins on any Python, by name."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [Requirement(line) for line in lines if line and not line.startswith("#")]
    return {normal(each.name): each for each in pins}


def test_every_pin_is_reached_from_what_pyproject_asks_for():
    """Some are needed by one Python alone, and have a marker that says so."""
    pins = {name for name, pin in pinned().items() if pin.marker is None or pin.marker.evaluate()}
    queue, reached, seen = [(name, "") for name in asked()], set(), set()
    while queue:
        name, extra = queue.pop()
        if (name, extra) in seen:
            continue
        seen.add((name, extra))
        reached.add(name)
        try:
            needs = [Requirement(line) for line in requires(name) or []]
        except PackageNotFoundError:
            pytest.skip(f"{name} is not installed here")
        wanted = [need for need in needs if need.marker is None or need.marker.evaluate({"extra": extra})]
        queue += [(normal(need.name), more) for need in wanted for more in ("", *need.extras)]
    assert pins <= reached, f"pinned, but nothing asks for them: {sorted(pins - reached)}"
    assert set(asked()) <= pins, f"asked for, but not pinned: {sorted(set(asked()) - pins)}"
    later = {name for name in reached & set(pinned()) if name not in pins}
    assert not later, f"needed, but their pin is for another Python: {sorted(later)}"


def test_every_bound_holds_what_the_tests_run_with():
    """And each dependency of the package has a lower bound, which `make test-pythons` installs."""
    for lines in (PROJECT["dependencies"], *PROJECT["optional-dependencies"].values()):
        for need in map(Requirement, lines):
            versions = pinned()[normal(need.name)].specifier
            assert all(each.operator == "==" and need.specifier.contains(each.version) for each in versions), need
            assert any(each.operator == ">=" for each in need.specifier), need
            assert not any(each.operator == "==" for each in need.specifier), f"{need} leaves no room beside others"


def test_the_command_for_all_pythons_asks_for_each_that_is_promised():
    from tools import pythons

    assert Requirement(f"python{PROJECT['requires-python']}").specifier.contains(pythons.PYTHONS[0])
    bounds = {normal(line.split("==")[0]) for line in pythons.lowest_pins(pythons.EXTRAS)}
    assert bounds == {name for name, extra in asked().items() if extra in ("base", *pythons.EXTRAS)}
    assert "tools/pythons.py" in (ROOT / "Makefile").read_text()


def test_the_reader_knows_what_a_module_belongs_to():
    owners = packages_distributions()
    for package, module in MODULES.items():
        assert package in {normal(each) for each in owners.get(module, [package])}
