"""What a release uploads works without the checkout: wheels and source archive, in an environment of their own."""

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PIP = ["-m", "pip", "--disable-pip-version-check", "--quiet"]
MOST_MB = 60.0
"""Largest size of the package [MB]."""


def run(*command: object, cwd: Path, **variables: str) -> str:
    """Runs a command that must succeed; returns what it printed."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "HEMLINE"))}
    done = subprocess.run(
        list(map(str, command)), cwd=cwd, env=environment | variables, capture_output=True, text=True, timeout=1200
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory) -> Path:
    """Wheels and source archives of the package and of its kernels: those in `HEMLINE_DIST`, or new ones."""
    if made := os.environ.get("HEMLINE_DIST"):
        return Path(made)
    folder = tmp_path_factory.mktemp("dist")
    builder = folder / "builder"
    run(sys.executable, "-m", "venv", builder, cwd=folder)
    run(builder / "bin" / "python", *PIP, "install", "hatchling", cwd=folder)
    for project in (ROOT, ROOT / "kernels"):
        run(builder / "bin" / "python", "-m", "hatchling", "build", "-d", folder / "dist", cwd=project)
    return folder / "dist"


@pytest.mark.slow
def test_the_wheel_has_the_package_and_nothing_else(dist):
    (wheel,) = dist.glob("hemline-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        assert sum(each.file_size for each in archive.infolist()) < MOST_MB * 2**20
    assert {name.split("/")[0] for name in names} == {"hemline", names[-1].split("/")[0]}
    assert "hemline/models/cape.safetensors" in names
    assert not [name for name in names if "__pycache__" in name or name.endswith(".pyc")]


@pytest.mark.slow
def test_the_source_archive_has_what_builds_and_tests_the_package(dist):
    (archive,) = dist.glob("hemline-0*.tar.gz")
    with tarfile.open(archive) as source:
        names = {name.split("/", 1)[1] for name in source.getnames() if "/" in name}
    assert {"pyproject.toml", "README.md", "LICENSE", "src/hemline/__init__.py", "tests/conftest.py"} <= names


@pytest.mark.slow
def test_wheels_play_the_demo_without_the_checkout(dist, tmp_path):
    """In a fresh environment, with the versions of `constraints.txt`, so that the packs of kernels fit."""
    run(sys.executable, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    python = tmp_path / "venv" / "bin" / "python"
    run(python, *PIP, "install", "-c", ROOT / "constraints.txt", *sorted(dist.glob("*.whl")), cwd=tmp_path)
    where = run(python, "-c", "import hemline; print(hemline.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(tmp_path)
    printed = run(
        tmp_path / "venv" / "bin" / "hemline",
        *("demo", "--out", "demo", "--json"),
        cwd=tmp_path,
        HEMLINE_CACHE_DIR=str(tmp_path / "cache"),
    )
    figures = json.loads(printed)
    assert {"cape", "dress", "tshirt tall"} <= set(figures)
    assert all(row["inside_percent"]["after"] == 0 for row in figures.values())
    assert (tmp_path / "demo" / "index.html").is_file()
    compiled = list((tmp_path / "cache").rglob("*.kernel"))
    assert not compiled, f"{len(compiled)} kernels were compiled, such as {compiled[0].name}"
