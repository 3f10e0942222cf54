"""GitHub runs each Python that pyproject.toml names, by commands of the project and pinned actions, without secrets."""

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from tools import pythons

yaml = pytest.importorskip("yaml")

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / ".github" / "workflows"
NAMES = ("release", "tests")
SYSTEMS = {"ubuntu", "windows", "macos"}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PYTHONS = [line.split(" :: ")[-1] for line in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", line)]


def jobs(name: str) -> dict:
    return yaml.safe_load((FOLDER / f"{name}.yml").read_text())["jobs"]


def steps(name: str) -> list[tuple[str, dict]]:
    return [(job, step) for job, content in jobs(name).items() for step in content["steps"]]


def test_there_are_no_others():
    assert sorted(path.stem for path in FOLDER.iterdir()) == list(NAMES)


def test_versions_of_python_are_stated_once_and_again_where_they_are_used():
    assert list(pythons.PYTHONS) == PYTHONS and PYTHONS[0] == PROJECT["requires-python"].removeprefix(">=")
    for name, job in (("tests", "pythons"), ("release", "kernels")):
        matrix = jobs(name)[job]["strategy"]["matrix"]
        assert matrix["python"] == PYTHONS
        assert {system.split("-")[0] for system in matrix["os"]} == SYSTEMS


@pytest.mark.parametrize("name", NAMES)
def test_commands_are_those_of_the_project(name):
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    tools = (ROOT / "Makefile").read_text()
    seen = set()
    for job, step in steps(name):
        command = re.sub(r"\$\{\{.*?\}\}", "X", step.get("run", ""))
        program, *words = shlex.split(command) or [""]
        if program == "make":
            assert set(words) <= targets, f"{job}: {command}"
        elif program == "python":
            assert (ROOT / words[0]).is_file() and words[0] in tools, f"{job}: {command}"
        else:
            assert program in ("", "gh", "test"), f"{job}: {command}"
        seen.add(" ".join([program, *words[:1]]))
    wanted = {
        "tests": {"make test", "make check", "make demo", "python tools/pythons.py"},
        "release": {"make dist", "make test-dist", "python tools/kernels.py"},
    }
    assert wanted[name] <= seen


@pytest.mark.parametrize("name", NAMES)
def test_actions_are_pinned_to_commits_and_there_are_no_secrets(name):
    text = (FOLDER / f"{name}.yml").read_text()
    used = re.findall(r"uses: (.*)", text)
    assert used and all(re.fullmatch(r"[\w.-]+/[\w.-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", each) for each in used)
    assert len({each.split("@")[0] for each in used}) == len(set(used)), "one version of each action"
    assert "secrets." not in text and "password" not in text


@pytest.mark.parametrize("name", NAMES)
def test_jobs_may_only_read_unless_they_publish(name):
    content = yaml.safe_load((FOLDER / f"{name}.yml").read_text())
    assert content["permissions"] == {"contents": "read"}
    granted = {job: each["permissions"] for job, each in content["jobs"].items() if "permissions" in each}
    publishing = {"publish": {"id-token": "write"}, "release": {"contents": "write"}}
    assert granted == (publishing if name == "release" else {})
    assert all(each["timeout-minutes"] <= 90 for each in content["jobs"].values())


def test_nothing_is_published_that_was_not_checked_or_has_no_tag():
    content = jobs("release")
    needs = {job: each.get("needs") for job, each in content.items()}
    assert needs == {"kernels": None, "build": "kernels", "check": "build", "publish": "check", "release": "publish"}
    assert content["publish"]["if"] == "github.ref_type == 'tag'"
    assert content["publish"]["environment"] == "pypi"


def test_both_packages_have_one_version():
    kernels = tomllib.loads((ROOT / "kernels" / "pyproject.toml").read_text())["project"]
    assert kernels["version"] == PROJECT["version"]
