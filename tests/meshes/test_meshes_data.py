"""Garments of other makers: all are read, with the counts that another program found."""

import csv
from pathlib import Path

import pytest

from hemline.meshes import boundary_loops, components, consistent_winding, read_obj

FOLDER = Path(__file__).resolve().parents[2] / "../shared/data/garments"
ROWS = list(csv.DictReader((FOLDER / "stats.csv").read_text().splitlines())) if FOLDER.is_dir() else []

pytestmark = [pytest.mark.data, pytest.mark.skipif(not ROWS, reason=f"no garments at {FOLDER}")]


@pytest.mark.parametrize("row", ROWS, ids=[row["file"] for row in ROWS])
def test_counts_are_those_of_the_table(row):
    mesh = read_obj(FOLDER / row["file"])
    assert (len(mesh.vertices), len(mesh.faces)) == (int(row["vertices"]), int(row["triangles"]))
    assert components(mesh.faces, len(mesh.vertices)).max() + 1 == int(row["components"])
    if int(row["vertices"]) < 10000:
        loops = boundary_loops(consistent_winding(mesh.faces)[0])
        sizes = sorted((int(size) for size in row["boundary_loop_sizes"].split("+")), reverse=True)
        assert [len(loop) for loop in loops] == sizes


def test_every_obj_of_the_folder_is_read():
    files = sorted(FOLDER.rglob("*.obj"))
    small = [file for file in files if file.stat().st_size < 1_000_000]
    assert len(small) >= 35
    for file in small:
        mesh = read_obj(file)
        assert mesh.faces.max() < len(mesh.vertices)
        if mesh.pattern is not None and mesh.pattern_faces is not None:
            assert mesh.pattern_faces.max() < len(mesh.pattern)
