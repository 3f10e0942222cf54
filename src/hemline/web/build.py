"""Make `page/kernels.wasm` of `page/kernels.ts`: `python -m hemline.web.build FOLDER`, where npm put assemblyscript.

Only who changes the kernels needs it; the result travels with the package.
"""

import subprocess
import sys
from pathlib import Path

from hemline.files import written_whole

PAGE = Path(__file__).parent / "page"
FLAGS = ("-O3", "--enable", "simd", "--runtime", "stub", "--importMemory", "--noAssert")


def build(compiler: Path, out: Path) -> None:
    """Compile the kernels.

    Args:
        compiler: The folder `node_modules` that holds assemblyscript.
        out: The file to write.

    Raises:
        subprocess.CalledProcessError: The compiler failed; the file is as it was.
    """
    command = ["node", str(compiler.resolve() / "assemblyscript/bin/asc.js"), "kernels.ts", *FLAGS, "--outFile"]
    with written_whole(out) as temporary:
        subprocess.run([*command, str(temporary)], cwd=PAGE, check=True)


if __name__ == "__main__":
    build(Path(sys.argv[1]), PAGE / "kernels.wasm")
