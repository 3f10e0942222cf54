"""The source files on which a compiled kernel depends; the kernel is recompiled when one of them changes."""

import ast
import hashlib
import sys
from functools import cache
from pathlib import Path

import llvmlite
import numba

PACKAGE = Path(__file__).parents[1]
_ENDING = "kernels.py"
_COMPILED = Path(__file__).parent


@cache
def kernel_files() -> dict[str, Path]:
    """Returns all files of the package with compiled code, by stem."""
    return {file.stem: file for file in sorted(PACKAGE.rglob(f"*{_ENDING}"))}


@cache
def source_hash(file: Path) -> str:
    """Returns a hash of `source_files(file)` and of the versions of Python, numba and llvmlite."""
    versions = f"{sys.version_info[:2]} {numba.__version__} {llvmlite.__version__}"
    digest = hashlib.sha256(versions.encode())
    for each in source_files(file):
        digest.update(each.read_bytes())
    return digest.hexdigest()[:16]


def source_files(file: Path) -> tuple[Path, ...]:
    """Returns the files whose code is compiled into the kernels of a file, sorted.

    These are the file itself, the kernel files that it imports, directly or not, since their functions are inlined,
    and the other modules of the package that any of these import, since their constants and named tuples are built in.

    Args:
        file: A kernel file, in this package or another.
    """
    found, queue = {file}, [file]
    while queue:
        for each in _imports(queue.pop()) - found:
            found.add(each)
            if each.name.endswith(_ENDING):
                queue.append(each)
    return tuple(sorted(found))


def _imports(file: Path) -> set[Path]:
    """Returns the modules that a file imports by relative names or by `hemline.`."""
    found = set()
    for node in ast.walk(ast.parse(file.read_bytes())):
        if not isinstance(node, ast.ImportFrom):
            continue
        names = node.module.split(".") if node.module else []
        if node.level:
            base = file.parents[node.level - 1]
        elif names[:1] == [PACKAGE.name]:
            base, names = PACKAGE, names[1:]
        else:
            continue
        module = base.joinpath(*names)
        found |= {_module(module)} | {_module(module / alias.name) for alias in node.names}
    return {each for each in found if each is not None and _COMPILED not in each.parents}


def _module(path: Path) -> Path | None:
    """Returns the file of a module, given without its ending; None if there is no such file."""
    file = path.with_name(f"{path.name}.py")
    return file if file.is_file() else None
