"""Machine code on disk: found again, compiled anew where the source changed, absent where it is damaged."""

import os
import random
import resource
import subprocess
import sys

import pytest

from hemline.compiled.sources import kernel_files, source_files
from tests.compiled.kernel_package import ANSWER, ask, kept, run, write_package


def test_a_second_process_compiles_nothing(tmp_path):
    write_package(tmp_path)
    cache = tmp_path / "cache"
    assert ask(tmp_path, cache) == "40"
    before = {each: each.stat().st_mtime_ns for each in kept(cache)}
    assert ask(tmp_path, cache) == "40"
    assert len(before) == 2
    assert {each: each.stat().st_mtime_ns for each in kept(cache)} == before


def test_options_that_are_sets_are_found_again_whatever_their_order(tmp_path):
    write_package(tmp_path)
    (tmp_path / "own" / "set_kernels.py").write_text(
        "from hemline.compiled import kernel\n\n"
        "@kernel(fastmath={'contract', 'nsz', 'reassoc', 'arcp'})\ndef third(x):\n    return x / 3\n"
    )
    for seed in range(5):
        done = run("from own.set_kernels import third; print(third(1.5))", tmp_path, tmp_path, PYTHONHASHSEED=str(seed))
        assert done.stdout.strip() == "0.5", done.stderr
    assert len(kept(tmp_path)) == 1


def test_a_changed_function_that_is_inlined_from_another_file_is_compiled_anew(tmp_path):
    cache = tmp_path / "cache"
    write_package(tmp_path)
    assert ask(tmp_path, cache) == "40"
    write_package(tmp_path, factor=3)
    assert ask(tmp_path, cache) == "60"


def test_a_changed_constant_of_a_plain_module_is_compiled_anew(tmp_path):
    cache = tmp_path / "cache"
    write_package(tmp_path)
    assert ask(tmp_path, cache) == "40"
    write_package(tmp_path, offset=1)
    assert ask(tmp_path, cache) == "41"


def test_kernels_depend_on_the_files_that_they_name():
    files = kernel_files()
    names = {each.name for each in source_files(files["conjugate_kernels"])}
    assert names >= {"conjugate_kernels.py", "block_kernels.py", "layout.py"}
    assert not any(each.parent.name == "compiled" for file in files.values() for each in source_files(file))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_a_file_that_was_cut_off_is_compiled_again(tmp_path, share):
    cache = tmp_path / "cache"
    write_package(tmp_path)
    ask(tmp_path, cache)
    whole = {each: each.read_bytes() for each in kept(cache)}
    for each, content in whole.items():
        each.write_bytes(content[: int(share * len(content))])
    assert ask(tmp_path, cache) == "40"
    assert {each: len(each.read_bytes()) for each in kept(cache)} == {each: len(whole[each]) for each in whole}


def test_a_file_with_flipped_bytes_is_never_unpickled(tmp_path):
    cache = tmp_path / "cache"
    write_package(tmp_path)
    ask(tmp_path, cache)
    draw = random.Random(1)
    for each in kept(cache):
        content = bytearray(each.read_bytes())
        for _ in range(20):
            content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
        each.write_bytes(content)
    assert ask(tmp_path, cache) == "40"


def test_where_there_is_no_room_kernels_run_and_it_is_said_once(tmp_path):
    write_package(tmp_path)
    cache = tmp_path / "cache"

    def small_files_only() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))

    code = f"import signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); {ANSWER}"
    done = subprocess.run(
        [sys.executable, "-B", "-c", code],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]), "HEMLINE_CACHE_DIR": str(cache)},
        preexec_fn=small_files_only,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout.strip()) == (0, "40"), done.stderr
    assert done.stderr.count("compiled kernels cannot be kept") == 1
    assert kept(cache) == []


def test_processes_that_compile_one_function_at_once_for_two_types_find_their_own(tmp_path):
    write_package(tmp_path)
    cache = tmp_path / "cache"
    code = "import sys; from own.outer_kernels import answer; x = {}; sys.stdin.readline(); print(answer(x))"
    variables = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]),
        "HEMLINE_CACHE_DIR": str(cache),
    }
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "env": variables}
    for _ in range(2):
        for value, said in (("1", "2"), ("1.5", "3.0")):
            started = [subprocess.Popen([sys.executable, "-c", code.format(value)], **pipes) for _ in range(2)]
            assert [each.communicate("go\n")[0].strip() for each in started] == [said, said]
    assert len(kept(cache)) == 4


def test_numbers_of_threads_give_the_same_numbers(tmp_path):
    write_package(tmp_path)
    code = (
        "import numpy as np; from hemline.compiled import use_threads; from own.outer_kernels import fill; "
        "use_threads({}); out = np.zeros(1000); fill(out); print(out.sum())"
    )
    said = {run(code.format(count), tmp_path, tmp_path / "cache").stdout.strip() for count in (1, 2)}
    assert said == {str(float(sum(i * i for i in range(1000))))}
    assert len(kept(tmp_path / "cache")) == 2
