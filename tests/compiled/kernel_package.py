"""A folder with kernels of its own, and processes that run them with a folder for machine code of their own."""

import os
import subprocess
import sys
from pathlib import Path

KERNELS = """
from hemline.compiled import kernel, prange
from .inner_kernels import doubled
from .constants import OFFSET

@kernel
def answer(x):
    return doubled(x) + OFFSET

@kernel(parallel=True)
def fill(out):
    for i in prange(out.shape[0]):
        out[i] = i * i
"""
INNER = """
from hemline.compiled import kernel

@kernel
def doubled(x):
    return {factor} * x
"""


def write_package(folder: Path, *, factor: int = 2, offset: int = 0) -> Path:
    """Write a package `own` whose function `answer(x)` gives `factor * x + offset`."""
    package = folder / "own"
    package.mkdir(exist_ok=True)
    (package / "__init__.py").write_text("")
    (package / "outer_kernels.py").write_text(KERNELS)
    (package / "inner_kernels.py").write_text(INNER.format(factor=factor))
    (package / "constants.py").write_text(f"OFFSET = {offset}\n")
    return package


def run(code: str, folder: Path, cache: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run Python code in a process of its own that can import the packages of a folder."""
    variables = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), *sys.path])} | environment
    if cache is not None:
        variables["HEMLINE_CACHE_DIR"] = str(cache)
    return subprocess.run([sys.executable, "-c", code], env=variables, capture_output=True, text=True, timeout=120)


ANSWER = "from own.outer_kernels import answer; print(answer(20))"


def ask(folder: Path, cache: Path, **environment: str) -> str:
    """What `answer(20)` gives in a new process, which must end well and say nothing else."""
    done = run(ANSWER, folder, cache, **environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def kept(cache: Path) -> list[Path]:
    """The compiled versions in a folder."""
    return sorted(cache.rglob("*.kernel"))
