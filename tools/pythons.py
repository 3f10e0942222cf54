"""Runs the tests with each installed Python, and once with the lowest versions that pyproject.toml allows.

    python tools/pythons.py                     all
    python tools/pythons.py 3.12 lowest         one Python, and the lowest versions
    python tools/pythons.py 3.13 -- tests/files -k beside

Each has its own environment, `.venv-3.12` or `.venv-lowest`, with its own folder for compiled kernels. PyTorch is not
installed, as its Linux builds contain gigabytes of CUDA, and tests that need it are reported as skipped;
`HEMLINE_TORCH=1` includes it. The script needs Python only.
"""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
"""Versions of Python that `pyproject.toml` names."""
LOWEST = "lowest"
EXTRAS = ["cluster", "usd", "view"]
TORCH = os.environ.get("HEMLINE_TORCH") == "1"
QUICK = [
    f"tests/{package}" for package in ("files", "motions", "meshes", "bodies", "garments", "export", "pictures", "cli")
]
"""Tests run with the lowest versions: those of libraries that read and write files, and of the command line."""
INSTALL = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]


def project() -> dict:
    """Reads the table `project` of pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def find_python(version: str) -> str | None:
    """Finds a Python of a version on the path, in pyenv, or this one."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    installed = map(str, sorted(pyenv.glob(f"{version}.*/bin/python"), reverse=True))
    places = [shutil.which(f"python{version}"), *installed, sys.executable]
    for place in filter(None, places):
        command = [place, "-c", "import sys; print('%d.%d' % sys.version_info[:2], sys.executable)"]
        # pyenv has shims for versions that are not installed
        printed = subprocess.run(command, capture_output=True, text=True).stdout
        reported, _, real = printed.strip().partition(" ")
        if reported == version:
            return real
    return None


def lowest_pins(extras: list[str]) -> list[str]:
    """Returns `name==version` for the lower bound of each dependency of the package and of some extras."""
    dependencies = [
        *project()["dependencies"],
        *(line for extra in extras for line in project()["optional-dependencies"][extra]),
    ]
    bounds = [re.match(r"([\w.-]+)\s*>=\s*([\w.]+)", line) for line in dependencies]
    missing = [line for line, bound in zip(dependencies, bounds, strict=True) if bound is None]
    if missing:
        raise SystemExit(f"pyproject.toml has no lower bound for {', '.join(missing)}")
    return [f"{bound[1]}=={bound[2]}" for bound in bounds if bound]


def environment(name: str, python: str, extras: list[str]) -> Path:
    """Returns a Python with the package, some extras and the test tools; remakes it if pyproject.toml changed."""
    folder = ROOT / f".venv-{name}"
    programs = "Scripts" if os.name == "nt" else "bin"
    inside, stamp = folder / programs / "python", folder / ".made"
    sources = [ROOT / "pyproject.toml", ROOT / "constraints.txt"]
    content = "\n".join([python, *extras, *(source.read_text() for source in sources)])
    if stamp.is_file() and stamp.read_text() == content:
        return inside
    shutil.rmtree(folder, ignore_errors=True)
    run([python, "-m", "venv", str(folder)])
    if name == LOWEST:
        pins = folder / "lowest.txt"
        pins.write_text("\n".join(lowest_pins(extras)) + "\n")
        extras = [*extras, "dev"]
    else:
        pins, extras = ROOT / "constraints.txt", [*extras, "docs", "dev"]
    run([str(inside), *INSTALL, "--constraint", str(pins), "--editable", f"{ROOT}[{','.join(extras)}]"])
    stamp.write_text(content)
    return inside


def run(command: list[str], *, check: bool = True, environ: dict[str, str] | None = None) -> int:
    """Prints and runs a command in the folder of the project."""
    print("$", " ".join(command), flush=True)
    status = subprocess.run(command, cwd=ROOT, env=os.environ | (environ or {})).returncode
    if status and check:
        raise SystemExit(f"ended with status {status}: {' '.join(command)}")
    return status


def run_tests(name: str, python: str, options: list[str]) -> bool:
    """Returns whether the tests pass in an environment, and with the lowest versions also the demo."""
    inside = environment(name, python, EXTRAS + (["learn"] if TORCH else []))
    kernels = {"HEMLINE_CACHE_DIR": str(inside.parents[1] / "kernels")}
    quick = [] if name != LOWEST else QUICK
    if name == LOWEST:
        demo = [str(inside.with_name("hemline")), "demo", "--out", f"out/demo-{name}"]
        if run(demo, check=False, environ=kernels):
            return False
    else:
        run([str(inside.with_name("hemline")), "warmup", "--jobs", "2"], environ=kernels)
    common = ["-m", "not slow", "--numprocesses", "auto", "--maxprocesses", "8", "--dist", "loadfile"]
    return run([str(inside), "-m", "pytest", *common, *(options or quick)], check=False, environ=kernels) == 0


def main(arguments: list[str]) -> int:
    """Runs the tests; returns 1 if some fail, and 2 if none of the Pythons is installed."""
    split = arguments.index("--") if "--" in arguments else len(arguments)
    names, options = arguments[:split] or [*PYTHONS, LOWEST], arguments[split + 1 :]
    unknown = [name for name in names if name not in (*PYTHONS, LOWEST)]
    if unknown:
        print(f"name {', '.join(PYTHONS)} or {LOWEST}; got {', '.join(unknown)}", file=sys.stderr)
        return 2
    results = {}
    for name in names:
        python = find_python(PYTHONS[0] if name == LOWEST else name)
        results[name] = (
            "not installed" if python is None else "passed" if run_tests(name, python, options) else "FAILED"
        )
    print("\nwith PyTorch" if TORCH else "\nwithout PyTorch (HEMLINE_TORCH=1 includes it)")
    for name, result in results.items():
        print(f"{'Python ' + name if name != LOWEST else 'the lowest versions'}: {result}")
    if set(results.values()) == {"not installed"}:
        return 2
    return int("FAILED" in results.values())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
