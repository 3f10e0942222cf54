"""Twelve thousand damaged files: none ends in another error than ours, takes 10 s, or 1 GB of memory.

`pytest -s tests/promises/test_damaged_files_soak.py` prints the slowest file and the memory of each kind.
"""

import resource
import time
import warnings

import numpy as np
import pytest

from hemline import motions
from hemline.errors import BadInput, HemlineWarning
from tests.motions.bvh_samples import person, text_of
from tests.motions.fbx_samples import fbx_of
from tests.promises.test_damaged_files import READERS, damaged, judged, whole

pytestmark = pytest.mark.slow

COUNT, FBX_COUNT = 720, 120
"""Files of each kind; an FBX is read by a process of its own."""
FILES = READERS | {"person.bvh": (text_of(person(8)).encode(), motions.read)}
SLOWEST_S, MOST_MB = 10.0, 1000.0


def several(content: bytes, random: np.random.Generator) -> bytes:
    """Damages a file in one to five places."""
    for _ in range(random.integers(1, 6)):
        content = damaged(content, random) if content else content
    return content


def memory_mb(who: int) -> float:
    """The most memory that this process, or one that it waited for, ever had."""
    return resource.getrusage(who).ru_maxrss / 1024


def soak(path, content, read, count):
    """Reads damaged files; returns how many were refused, and the longest time [s]."""
    random, refused, slowest = np.random.default_rng(2026), 0, 0.0
    for _ in range(count):
        path.write_bytes(several(content, random))
        began = time.perf_counter()
        try:
            read(path)
        except BadInput as error:
            judged(error)
            refused += 1
        slowest = max(slowest, time.perf_counter() - began)
    return refused, slowest


@pytest.mark.parametrize("name", [*FILES, "clip.fbx"])
def test_no_damaged_file_costs_much(name, tmp_path):
    if name == "clip.fbx":
        pytest.importorskip("ufbx")
        content, read, count, who = fbx_of(person(8)).encode(), motions.read, FBX_COUNT, resource.RUSAGE_CHILDREN
    else:
        content = whole(tmp_path, name) if name in READERS else FILES[name][0]
        read, count, who = FILES[name][1], COUNT, resource.RUSAGE_SELF
    before = memory_mb(who) if who == resource.RUSAGE_SELF else 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", HemlineWarning)
        refused, slowest = soak(tmp_path / f"damaged_{name}", content, read, count)
    grown = memory_mb(who) - before
    print(f"{name}: {refused} of {count} refused, slowest {slowest:.2f} s, {grown:.0f} MB more than before")
    assert 0 < refused <= count
    assert slowest < SLOWEST_S and grown < MOST_MB
