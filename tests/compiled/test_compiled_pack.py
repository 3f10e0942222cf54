"""Packs of kernels: used where they fit, and compiled anew, with the same result, where they do not."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from hemline.compiled import pack as packs
from hemline.compiled.pack import TARGET, open_pack, pack_name, write_pack
from tests.compiled.kernel_package import ask, kept, run, write_package

needs_target = pytest.mark.skipif(not TARGET.runs_here(), reason=f"this machine does not run {TARGET.processor}")


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """A pack of the kernel of the package that `write_package` writes in the same folder."""
    write_package(tmp_path)
    variables = {"NUMBA_CPU_NAME": TARGET.processor, "NUMBA_CPU_FEATURES": TARGET.features}
    assert ask(tmp_path, tmp_path / "first", HEMLINE_KERNEL_PACK="none", **variables) == "40"
    assert write_pack(tmp_path / "made.pack", tmp_path / "first", TARGET) == 2
    return tmp_path / "made.pack"


def ask_with(pack: Path, cache: str = "cache") -> tuple[str, int]:
    """The answer with a pack and an empty cache, and the number of kernels that were compiled."""
    folder = pack.parent / cache
    return ask(pack.parent, folder, HEMLINE_KERNEL_PACK=str(pack)), len(kept(folder))


@needs_target
def test_with_a_pack_nothing_is_compiled(made):
    assert ask_with(made) == ("40", 0)
    assert ask_with(made) == ("40", 0)  # from what the first process unpacked
    assert [each.suffix for each in (made.parent / "cache").iterdir() if each.is_file()] == [".kernels"]


@needs_target
def test_without_a_pack_each_kernel_is_compiled(made):
    assert ask(made.parent, made.parent / "cache", HEMLINE_KERNEL_PACK="none") == "40"
    assert len(kept(made.parent / "cache")) == 2


def test_it_is_said_in_one_line_that_kernels_are_compiled(tmp_path):
    environment = os.environ | {"HEMLINE_CACHE_DIR": str(tmp_path), "HEMLINE_KERNEL_PACK": "none"}
    command = [sys.executable, "-m", "hemline", "explain", "cape"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0
    assert len(kept(tmp_path)) > 0
    assert done.stderr.count("hemline: compiling for this processor") == 1


@needs_target
def test_a_kernel_whose_source_changed_is_compiled(made):
    write_package(made.parent, factor=3)
    assert ask_with(made) == ("60", 2)


@needs_target
@pytest.mark.parametrize("share", [0.0, 0.2, 0.9, 0.999])
def test_a_pack_that_was_cut_off_is_not_used(made, share):
    content = made.read_bytes()
    made.write_bytes(content[: int(share * len(content))])
    assert ask_with(made) == ("40", 2)


@needs_target
@pytest.mark.parametrize("where", [0.5, 0.99])
def test_a_pack_with_a_flipped_byte_is_not_used(made, where):
    content = bytearray(made.read_bytes())
    start = content.rindex(b"\xfd7zXZ")
    content[start + int(where * (len(content) - start))] ^= 1
    made.write_bytes(content)
    assert ask_with(made) == ("40", 2)


@needs_target
def test_an_unpacked_file_that_was_changed_is_never_run(made):
    ask_with(made)
    (unpacked,) = (made.parent / "cache").glob("*.kernels")
    content = bytearray(unpacked.read_bytes())
    content[len(content) // 4 :: 97] = bytes(len(content[len(content) // 4 :: 97]))
    unpacked.write_bytes(content)
    assert ask_with(made)[0] == "40"


@needs_target
@pytest.mark.parametrize(
    "change",
    [
        {"versions": {"python": "3.11", "numba": "0.1", "llvmlite": "0.1"}},
        {"versions": 5},
        {"target": [TARGET.triple, "x86-64-v9", TARGET.features + ",+no-such-instructions"]},
        {"target": ["arm64-apple-darwin", "apple-m1", "+neon"]},
    ],
)
def test_a_pack_for_another_numba_or_processor_is_not_used(made, change):
    magic, header, rest = made.read_bytes().split(b"\n", 2)
    made.write_bytes(b"\n".join([magic, json.dumps(json.loads(header) | change).encode(), rest]))
    assert ask_with(made) == ("40", 2)


@pytest.mark.parametrize(
    "content", [b"", b"nonsense\n", b"hemline kernel pack 1\n[]\n", b"hemline kernel pack 1\n{}\n"]
)
def test_other_files_are_no_packs(tmp_path, content):
    (tmp_path / "x.pack").write_bytes(content)
    assert open_pack(tmp_path / "x.pack") is None
    assert open_pack(tmp_path / "absent.pack") is None
    assert open_pack(tmp_path) is None


@needs_target
def test_where_nothing_can_be_written_the_pack_is_used_all_the_same(made):
    """With an ordinary user's rights: root may write anywhere."""
    cache = made.parent / "cache"
    cache.write_text("a file where a folder should be")
    code = "import warnings; warnings.simplefilter('ignore'); from own.outer_kernels import answer; print(answer(20))"
    blocked = {"HOME": str(cache), "XDG_CACHE_HOME": str(cache), "TMPDIR": str(cache)}
    done = run(code, made.parent, cache, HEMLINE_KERNEL_PACK=str(made), **blocked)
    assert (done.returncode, done.stdout.strip()) == (0, "40"), done.stderr


SHIPPED = find_spec(packs.PACKAGE) is not None and TARGET.runs_here()
needs_pack = pytest.mark.skipif(not SHIPPED, reason="hemline-kernels is not installed, or not for this machine")
PLAY = """
import sys, time
import numpy as np
import hemline
began = time.perf_counter()
body = hemline.bodies.load("anny24").shaped()
frames = list(hemline.play(hemline.load(sys.argv[1]), body, hemline.motions.load("run")[:3]))
np.save(sys.argv[2], frames[-1].vertices)
print(time.perf_counter() - began)
"""


@needs_pack
@pytest.mark.parametrize("model", ["cape", "tshirt-light"])
def test_a_shipped_model_plays_and_nothing_is_compiled(tmp_path, model):
    """With the pack of this Python, which `make kernels` makes again after a kernel has changed."""
    variables = os.environ | {"HEMLINE_CACHE_DIR": str(tmp_path / "cache"), "HEMLINE_KERNEL_PACK": ""}
    command = [sys.executable, "-c", PLAY, model, str(tmp_path / "last.npy")]
    done = subprocess.run(command, env=variables, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert kept(tmp_path / "cache") == []


@needs_pack
@pytest.mark.slow
@pytest.mark.parametrize("model", ["tshirt-light", "trousers-light"])
def test_a_model_plays_to_the_same_bits_without_packs(tmp_path, model):
    """Close-fitting garments have kernels that may reorder sums, which depends on the length of vectors."""
    last = []
    for name, pack in (("packed", ""), ("compiled", "none")):
        variables = os.environ | {"HEMLINE_CACHE_DIR": str(tmp_path / name), "HEMLINE_KERNEL_PACK": pack}
        command = [sys.executable, "-c", PLAY, model, str(tmp_path / f"{name}.npy")]
        subprocess.run(command, env=variables, check=True, timeout=300)
        last.append((tmp_path / f"{name}.npy").read_bytes())
    assert kept(tmp_path / "packed") == []
    assert len(kept(tmp_path / "compiled")) > 20
    assert last[0] == last[1]


@needs_pack
def test_there_is_a_pack_for_this_python():
    (folder,) = find_spec(packs.PACKAGE).submodule_search_locations
    pack = open_pack(Path(folder) / pack_name())
    assert pack is not None
    assert pack.target == TARGET
