"""Compiles `page/kernels.ts` to `page/kernels.wasm`: `python -m hemline.web.build node_modules`.

This is needed only after changes of the kernels, since the package contains the result.
"""

import subprocess
import sys
from pathlib import Path

from hemline.files import atomic_write

PAGE = Path(__file__).parent / "page"
FLAGS = ("-O3", "--enable", "simd", "--runtime", "stub", "--importMemory", "--noAssert")


def build(compiler: Path, out: Path) -> None:
    """Compiles the kernels.

    Args:
        compiler: The folder `node_modules` that contains assemblyscript.
        out: The file to write.

    Raises:
        subprocess.CalledProcessError: The compiler failed; the file is unchanged.
    """
    command = ["node", str(compiler.resolve() / "assemblyscript/bin/asc.js"), "kernels.ts", *FLAGS, "--outFile"]
    with atomic_write(out) as temporary:
        subprocess.run([*command, str(temporary)], cwd=PAGE, check=True)


if __name__ == "__main__":
    build(Path(sys.argv[1]), PAGE / "kernels.wasm")
