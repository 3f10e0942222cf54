"""Builds the extension by Blender's own command: `python integrations/blender/build.py FOLDER`, in Blender's Python.

The command `blender --command extension` is a script of Blender that also runs in the Python of its module `bpy`.
The zip gets the licence of hemline, and is checked as Blender checks it before it is installed.
"""

import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

SOURCE = Path(__file__).parent / "hemline"
LICENCE = Path(__file__).parents[2] / "LICENSE"


def find_command() -> list[str]:
    """Returns the words that begin `blender --command extension`.

    Raises:
        SystemExit: This Python has no Blender.
    """
    found = find_spec("bpy")
    scripts = sorted(Path(found.origin).parent.rglob("bl_pkg/cli/blender_ext.py")) if found and found.origin else []
    if not scripts:
        raise SystemExit(f"this needs the Python of Blender; got {sys.executable}; run make judges-install")
    return [sys.executable, str(scripts[0])]


def build(folder: Path) -> None:
    """Writes `hemline-VERSION.zip` into a folder and validates it; prints what Blender says."""
    command = find_command()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        staged = shutil.copytree(SOURCE, Path(temporary) / "hemline", ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(LICENCE, staged)
        built = Path(temporary) / "built"
        built.mkdir()
        subprocess.run([*command, "build", "--source-dir", staged, "--output-dir", built], check=True)
        (package,) = built.glob("*.zip")
        subprocess.run([*command, "validate", package], check=True)
        shutil.copy(package, folder)


if __name__ == "__main__":
    build(Path(sys.argv[1]))
