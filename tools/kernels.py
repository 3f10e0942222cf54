"""Compiles all kernels in advance, into one pack for each installed Python: `python tools/kernels.py`.

    python tools/kernels.py              all installed Pythons from 3.11 to 3.14
    python tools/kernels.py 3.12         one of them
    python tools/kernels.py --into packs into another folder than that of the package

Each Python has the environment that `tools/pythons.py` makes. Kernels are compiled for `hemline.compiled.pack.TARGET`,
which this machine has to run, by `hemline warmup` with an empty cache, which takes some five minutes of processor time
for each Python.
"""

import argparse
import os
import subprocess
import tempfile
from pathlib import Path

from pythons import PYTHONS, environment, find_python

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "kernels" / "hemline_kernels"
WRITE = (
    "import sys; from pathlib import Path; from hemline.compiled.pack import TARGET, pack_name, write_pack; "
    "TARGET.runs_here() or sys.exit(f'no packs are made for this machine; got {TARGET.triple} as the target'); "
    "path = Path(sys.argv[1], pack_name()); count = write_pack(path, Path(sys.argv[2]), TARGET); "
    "print(f'{path.name}: {count} kernels, {path.stat().st_size / 1e6:.1f} MB')"
)


def make_pack(python: Path, into: Path) -> None:
    """Compiles all kernels with one Python, and packs them into a folder."""
    with tempfile.TemporaryDirectory() as folder:
        variables = {"HEMLINE_CACHE_DIR": folder, "HEMLINE_KERNEL_PACK": "none"}
        warmup = [python, "-m", "hemline", "warmup", "--jobs", str(os.cpu_count() or 1)]
        subprocess.run(warmup, check=True, env=os.environ | variables)
        subprocess.run([python, "-c", WRITE, into, folder], check=True)


def main() -> None:
    """Makes the packs of all Pythons that are named, or of all that are installed."""
    parser = argparse.ArgumentParser(description="Compiles all kernels in advance.")
    parser.add_argument("pythons", nargs="*", help="Versions, such as 3.12; by default all that are installed.")
    parser.add_argument("--into", type=Path, default=FOLDER, help="Folder of the packs; by default the package's.")
    asked = parser.parse_args()
    found = {version: find_python(version) for version in asked.pythons or PYTHONS}
    if missing := [version for version in asked.pythons if found[version] is None]:
        raise SystemExit(f"not installed: {', '.join(missing)}")
    asked.into.mkdir(parents=True, exist_ok=True)
    for version, python in found.items():
        if python is not None:
            make_pack(environment(version, python, []), asked.into.resolve())


if __name__ == "__main__":
    main()
