"""Reads FBX by way of GLB: a process of its own converts it, so that a crash of the library ends that process only."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from hemline.errors import BadInput, MissingExtra

from .reading import read_bytes

ENDING = ".fbx"
"""File ending of FBX."""
CURE = "import it in Blender, and export it as .glb"

_BYTES_MAX = 2**30
_SECONDS_MAX = 120


def fbx_as_glb(path: Path, *, error: type[BadInput]) -> bytes:
    """Returns a GLB with the nodes, meshes, skins and animations of an FBX, sampled at the rate of its scene.

    Args:
        path: The file.
        error: Class of the exception.

    Raises:
        MissingExtra: The library ufbx is not installed.
        BadInput: (as `error`) The file is missing, damaged, or holds nothing that can be converted.
    """
    content = read_bytes(path, _BYTES_MAX, error=error, cure="name a file that exists")
    if find_spec("ufbx") is None:
        raise MissingExtra("ufbx", "fbx", f"reading {path}")
    command = [sys.executable, "-m", "hemline.files.fbx_child"]
    try:
        done = subprocess.run(command, input=content, capture_output=True, timeout=_SECONDS_MAX, check=False)
    except subprocess.TimeoutExpired as reason:
        raise error(f"{path} takes too long to read", f"more than {_SECONDS_MAX} s", CURE) from reason
    if done.returncode or done.stdout[:4] != b"glTF":
        lines = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise error(f"{path} cannot be read as FBX", lines[-1][:200] if lines else "a crash of the reader", CURE)
    return done.stdout
