"""Nothing is deleted that cannot be read: what is damaged is renamed, what may be whole stays and is said."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hemline.datasets import create, open_dataset, read_take, write_take
from hemline.errors import BadDataset, DamagedTake, HemlineWarning
from hemline.files import read_tensors, write_tensors
from tests.datasets.dataset_samples import make_garment, make_take


@pytest.fixture
def dataset(tmp_path):
    made = create(tmp_path / "data", make_garment())
    for seed, clip in enumerate(("02_01", "05_02")):
        made.add(make_take(made.garment, clip, seed=seed))
    return made


@pytest.fixture
def victim(dataset) -> Path:
    return dataset.path(dataset.rows()[0].name)


def inputs_of(path: Path) -> dict:
    return dict(read_take(path).inputs)


def left(dataset) -> list[str]:
    return sorted(path.name for path in dataset.takes_folder.iterdir())


def not_finite(path: Path) -> None:
    arrays, metadata = read_tensors(path, "take")
    arrays["vertices"][0, 0, 0] = np.nan
    write_tensors(path, arrays, metadata)


DAMAGES = {
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-10]),
    "cut off in its header": lambda path: path.write_bytes(path.read_bytes()[:100]),
    "empty": lambda path: path.write_bytes(b""),
    "zeros": lambda path: path.write_bytes(bytes(path.stat().st_size)),
    "not finite": not_finite,
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_take_is_renamed_with_its_bytes_and_counts_as_none(dataset, victim, name):
    inputs = inputs_of(victim)
    DAMAGES[name](victim)
    damaged = victim.read_bytes()
    with pytest.raises(DamagedTake, match=f"{victim.name}.*it puts the file aside"):
        dataset.rows()
    with pytest.warns(HemlineWarning, match=rf"{victim.name}.*it is kept as {victim.name}.damaged and made again"):
        assert dataset.find_by_inputs(inputs) is None
    assert not victim.exists()
    assert victim.with_name(f"{victim.name}.damaged").read_bytes() == damaged
    assert [row.clip for row in dataset.rows()] == ["05_02"] and dataset.find_by_inputs(inputs) is None


def test_one_that_is_damaged_again_gets_a_name_of_its_own(dataset, victim):
    whole = victim.read_bytes()
    for count in (10, 20, 30):
        victim.write_bytes(whole[:-count])
        with pytest.warns(HemlineWarning):
            dataset.put_damaged_aside()
    aside = [path for path in dataset.takes_folder.iterdir() if "damaged" in path.name]
    assert sorted(path.name.removeprefix(victim.name) for path in aside) == [".damaged", ".damaged2", ".damaged3"]
    assert sorted(len(whole) - path.stat().st_size for path in aside) == [10, 20, 30]


def newer(path: Path) -> None:
    arrays, metadata = read_tensors(path, "take")
    write_tensors(path, arrays, metadata | {"format": 2})


def of_another_kind(path: Path) -> None:
    make_garment().save(path)


def a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def a_failing_disk(path: Path) -> None:
    path.unlink()
    path.symlink_to("/proc/self/mem")  # its first byte cannot be read


def a_link_to_nowhere(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.parent / "of a disk that is not mounted")


def of_other_inputs(path: Path) -> None:
    write_take(path, make_take(make_garment(), "07_01", seed=7))


def of_other_vertices(path: Path) -> None:
    take = read_take(path)
    write_take(path, replace(take, vertices=take.vertices[:, :3]))


MAY_BE_WHOLE = {
    "newer": (newer, "has a newer format; got version 2; this hemline reads up to 1; upgrade it"),
    "of another kind": (of_another_kind, "must be a take file; got a garment file"),
    "a folder": (a_folder, "cannot read .*; got a folder"),
    "a link to nowhere": (a_link_to_nowhere, "cannot read .*; got No such file or directory"),
    "of other inputs": (of_other_inputs, "holds another take than its name says"),
    "of other vertices": (of_other_vertices, "is of another garment; got 3 vertices for the 4 of square"),
}
if sys.platform == "linux":
    MAY_BE_WHOLE["a disk that fails"] = (a_failing_disk, "cannot read .*; got Input/output error")


@pytest.mark.parametrize("name", MAY_BE_WHOLE)
def test_what_may_be_whole_stays_and_is_said(dataset, victim, name):
    inputs = inputs_of(victim)
    change, message = MAY_BE_WHOLE[name]
    change(victim)
    before = left(dataset)
    with pytest.raises(BadDataset, match=message) as found:
        dataset.find_by_inputs(inputs)
    assert not isinstance(found.value, DamagedTake)
    if name != "of other inputs":
        with pytest.raises(BadDataset, match=message):
            dataset.put_damaged_aside()
    assert left(dataset) == before


AS_ANOTHER = """
import os, sys
from hemline.datasets import open_dataset
from hemline.errors import BadDataset
dataset = open_dataset(sys.argv[1])
if sys.argv[2] == "files":
    held = []
    try:
        while True:
            held.append(os.open(os.devnull, os.O_RDONLY))
    except OSError:
        pass
for attempt in (lambda: dataset.find(sys.argv[3]), dataset.put_damaged_aside):
    try:
        attempt()
        print("read")
    except BadDataset as error:
        print(error)
"""


def said_by(dataset, how: str, name: str) -> list[str]:
    """What a process says that reads a take with fewer rights, or with no files left to open."""
    command = [sys.executable, "-c", AS_ANOTHER, str(dataset.folder), how, name]
    if how == "rights" and os.geteuid() == 0:
        if shutil.which("setpriv") is None:
            pytest.skip("root reads everything, and setpriv, which takes that right away, is not installed")
        command = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search", *command]
    if how == "files":
        command = ["sh", "-c", 'ulimit -n 64; exec "$@"', "sh", *command]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    if done.returncode and "setpriv" in done.stderr:
        pytest.skip(f"rights cannot be taken away here: {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.skipif(os.name != "posix", reason="rights of files, as POSIX has them")
@pytest.mark.parametrize("indexed", [True, False])
def test_a_take_of_somebody_else_that_may_not_be_read_stays(dataset, victim, indexed):
    if not indexed:
        (dataset.folder / "manifest.json").unlink()
    before = victim.read_bytes()
    if os.geteuid() == 0:
        os.chown(victim, 65534, 65534)
        victim.chmod(0o600)
    else:
        victim.chmod(0)
    said = said_by(dataset, "rights", victim.stem)
    victim.chmod(0o644)
    assert len(said) == 2
    for line in said:
        assert f"cannot read {victim}; got Permission denied; " in line
    assert victim.read_bytes() == before and len(left(dataset)) == 2


@pytest.mark.skipif(os.name != "posix", reason="limits of open files, as POSIX has them")
def test_where_no_more_files_can_be_opened_all_takes_stay(dataset, victim):
    before = left(dataset)
    said = said_by(dataset, "files", victim.stem)
    assert len(said) == 2 and all("got Too many open files" in line for line in said), said
    assert left(dataset) == before


def test_a_take_replaced_by_one_of_equal_size_gets_a_row_of_its_own(dataset, victim):
    old = dataset.rows()[0]
    take = read_take(victim)
    changed = take.vertices + np.float32(0.5)
    write_take(victim, replace(take, vertices=changed, figures={"edge_strain_p99": 0.09}))
    stamp = victim.stat().st_mtime_ns + 1_000_000
    os.utime(victim, ns=(stamp, stamp))
    assert victim.stat().st_size == old.bytes
    row = open_dataset(dataset.folder).rows()[0]
    assert (row.name, row.figures) == (old.name, {"edge_strain_p99": 0.09})
    assert row.sha256 != old.sha256 and row.stamp == stamp
    dataset.verify()


def test_an_index_whose_values_are_of_other_kinds_is_made_again(dataset):
    rows, index = dataset.rows(), dataset.folder / "manifest.json"
    content = json.loads(index.read_text())
    for name, value in (
        ("betas", ["a"]),
        ("betas", [1e999]),
        ("figures", {"a": "b"}),
        ("figures", [1]),
        ("frames", "6"),
        ("simulator", True),
        ("failed", 1),
        ("kind", {}),
        ("sha256", None),
    ):
        wrong = [row | {name: value} for row in content["takes"]]
        index.write_text(json.dumps(content | {"takes": wrong}))
        assert open_dataset(dataset.folder).rows() == rows, name
    index.write_text("[" * 100_000)
    assert open_dataset(dataset.folder).rows() == rows


def test_an_index_from_before_simulators_had_numbers_is_good(dataset):
    rows, index = dataset.rows(), dataset.folder / "manifest.json"
    content = json.loads(index.read_text())
    for row in content["takes"]:
        del row["simulator"]
    index.write_text(json.dumps(content))
    stamp = index.stat().st_mtime_ns
    assert open_dataset(dataset.folder).rows() == rows
    assert index.stat().st_mtime_ns == stamp  # no take was read again
