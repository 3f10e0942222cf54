"""Run the tests on each Python at hand, and once with the lowest versions that pyproject.toml allows.

    python tools/pythons.py                     all of it
    python tools/pythons.py 3.12 lowest         one Python, and the lowest versions
    python tools/pythons.py 3.13 -- tests/files -k beside

Each gets an environment of its own, `.venv-3.12` or `.venv-lowest`, with a folder of its own for compiled kernels.
PyTorch is left out, since its builds for Linux bring gigabytes of CUDA: tests that need it are skipped, and say so.
`HEMLINE_TORCH=1` takes it along. Nothing but Python itself is needed.
"""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.11", "3.12", "3.13")
LOWEST = "lowest"
EXTRAS = ["cluster", "usd", "view"]
TORCH = os.environ.get("HEMLINE_TORCH") == "1"
QUICK = [f"tests/{room}" for room in ("files", "motions", "meshes", "bodies", "garments", "export", "pictures", "cli")]
"""What is run with the lowest versions: all that reads and writes through a library, and the command line."""
INSTALL = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]


def project() -> dict:
    """The table `project` of pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def found(version: str) -> str | None:
    """A Python of that version: on the path, or where pyenv keeps its own."""
    kept = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    places = [shutil.which(f"python{version}"), *map(str, sorted(kept.glob(f"{version}.*/bin/python"), reverse=True))]
    for place in filter(None, places):
        asked = [place, "-c", "import sys; print('%d.%d' % sys.version_info[:2], sys.executable)"]
        said = subprocess.run(asked, capture_output=True, text=True)  # a shim may stand for a version that is not there
        told, _, real = said.stdout.strip().partition(" ")
        if told == version:
            return real
    return None


def lowest_pins(extras: list[str]) -> list[str]:
    """`name==version` for the lower bound of each dependency of the package and of these extras."""
    asked = [
        *project()["dependencies"],
        *(line for extra in extras for line in project()["optional-dependencies"][extra]),
    ]
    bounds = [re.match(r"([\w.-]+)\s*>=\s*([\w.]+)", line) for line in asked]
    missing = [line for line, bound in zip(asked, bounds, strict=True) if bound is None]
    if missing:
        raise SystemExit(f"pyproject.toml has no lower bound for {', '.join(missing)}")
    return [f"{bound[1]}=={bound[2]}" for bound in bounds if bound]


def environment(name: str, python: str, extras: list[str]) -> Path:
    """A Python with the package, these extras and what the tests need; made anew where pyproject.toml changed."""
    folder = ROOT / f".venv-{name}"
    inside, stamp = folder / "bin" / "python", folder / ".made"
    sources = [ROOT / "pyproject.toml", ROOT / "constraints.txt"]
    told = "\n".join([python, *extras, *(each.read_text() for each in sources)])
    if stamp.is_file() and stamp.read_text() == told:
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
    stamp.write_text(told)
    return inside


def run(command: list[str], *, check: bool = True, **environ: str) -> int:
    """A command in the folder of the project, shown before it runs."""
    print("$", " ".join(command), flush=True)
    status = subprocess.run(command, cwd=ROOT, env=os.environ | environ).returncode
    if status and check:
        raise SystemExit(f"ended with status {status}: {' '.join(command)}")
    return status


def tested(name: str, python: str, options: list[str]) -> bool:
    """Whether the tests pass in an environment of that name; with the lowest versions also the demo."""
    inside = environment(name, python, EXTRAS + (["learn"] if TORCH else []))
    kernels = {"HEMLINE_CACHE_DIR": str(inside.parents[1] / "kernels")}
    quick = [] if name != LOWEST else QUICK
    if name == LOWEST:
        demo = [str(inside.with_name("hemline")), "demo", "--out", f"out/demo-{name}"]
        if run(demo, check=False, **kernels):
            return False
    else:
        run([str(inside.with_name("hemline")), "warmup", "--jobs", "2"], **kernels)
    shared = ["-m", "not slow", "--numprocesses", "auto", "--maxprocesses", "8", "--dist", "loadfile"]
    return run([str(inside), "-m", "pytest", *shared, *(options or quick)], check=False, **kernels) == 0


def main(arguments: list[str]) -> int:
    """Run all that is asked for; 1 where some tests fail, 2 where none of these Pythons is at hand."""
    split = arguments.index("--") if "--" in arguments else len(arguments)
    asked, options = arguments[:split] or [*PYTHONS, LOWEST], arguments[split + 1 :]
    unknown = [each for each in asked if each not in (*PYTHONS, LOWEST)]
    if unknown:
        print(f"name {', '.join(PYTHONS)} or {LOWEST}; got {', '.join(unknown)}", file=sys.stderr)
        return 2
    results = {}
    for name in asked:
        python = found(PYTHONS[0] if name == LOWEST else name)
        results[name] = "not at hand" if python is None else "passed" if tested(name, python, options) else "FAILED"
    print("\nwith PyTorch" if TORCH else "\nwithout PyTorch (HEMLINE_TORCH=1 takes it along)")
    for name, result in results.items():
        print(f"{'Python ' + name if name != LOWEST else 'the lowest versions'}: {result}")
    if set(results.values()) == {"not at hand"}:
        return 2
    return int("FAILED" in results.values())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
