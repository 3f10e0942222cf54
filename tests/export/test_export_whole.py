"""Files of clips are whole or not there: a writer that is killed at any step, a disk that is full, in every format."""

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from hemline import export
from hemline.export.write import FORMATS
from tests.files.killed import killed_at_each_step, limited

ENDINGS = [
    pytest.param(
        ending,
        marks=pytest.mark.skipif(
            ending == ".usdc" and importlib.util.find_spec("pxr") is None,
            reason="usd-core is not installed: pip install 'hemline[usd]'",
        ),
    )
    for ending in FORMATS
]
BEFORE = """
import sys
from hemline.errors import BadOutput
from tests.export.test_export_whole import clip, export
"""


def clip(seed: int) -> export.Clip:
    """A ball whose surface trembles."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    moved = np.random.default_rng(seed).normal(scale=0.02, size=(3, len(ball.vertices), 3))
    return export.Clip((ball.vertices + moved).astype(np.float32), ball.faces.astype(np.int32), 30.0)


def contents(folder: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for each in folder.iterdir() if each.is_file()}


def written(folder: Path, seed: int, ending: str) -> dict[str, bytes]:
    """What files a clip is written to."""
    folder.mkdir()
    export.write(folder / f"out{ending}", clip(seed))
    return contents(folder)


@pytest.mark.parametrize("ending", ENDINGS)
def test_each_file_is_the_old_or_the_new_one_wherever_its_writer_is_killed(tmp_path, ending):
    old, new = written(tmp_path / "out", 1, ending), written(tmp_path / "new", 2, ending)
    assert old.keys() == new.keys() and old != new
    folder, elsewhere, times = tmp_path / "out", tmp_path / "elsewhere", {"old": 0, "new": 0}
    elsewhere.mkdir()
    once = f"made = clip(2)\nexport.write('once{ending}', made)"  # so that all is imported before it is killed
    work = f"{BEFORE}\n{once}\ndef work(): export.write({str(folder / f'out{ending}')!r}, made)"
    for _ in killed_at_each_step(work, elsewhere, every=9):
        found = contents(folder)
        assert found.keys() == old.keys()
        assert all(content in (old[name], new[name]) for name, content in found.items())
        times["old"] += found == old
        times["new"] += found == new
        for name in old:
            (folder / name).write_bytes(old[name])
    assert min(times.values()) > 0
    assert sorted(os.listdir(folder)) == sorted(old)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_full_disk_is_one_line_and_leaves_the_old_files_and_nothing_else(tmp_path, ending):
    old = written(tmp_path / "out", 1, ending)
    again = f"""
try:
    export.write('out{ending}', clip(2))
except BadOutput as error:
    print(error)
"""
    most = max(map(len, old.values())) // 2
    said = limited(again, tmp_path / "out", before=BEFORE, most_bytes=most)
    assert said.startswith("cannot write out") and "File too large" in said and said.count("\n") == 1
    assert contents(tmp_path / "out") == old and sorted(os.listdir(tmp_path / "out")) == sorted(old)
