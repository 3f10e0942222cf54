"""Whatever ships is named in NOTICE, holds its own terms, and these go along into what is exported."""

import fnmatch
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pygltflib
import pytest

import hemline
from hemline import animators, bodies, export, garments
from hemline.animators.model_file import save_model
from hemline.animators.ropes import AnimatorRopes
from hemline.animators.terms import garment_terms, terms_of
from hemline.datasets import Take
from hemline.files import content_hash
from hemline.models.make import body as body_made
from hemline.models.make import terms as made
from hemline.motions import Motion
from hemline.motions.shipped import names as clip_names
from hemline.motions.terms import CMU_TERMS, as_stated
from hemline.playback import character
from hemline.playback.record import record_take

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "hemline"
NOTICE = (ROOT / "NOTICE").read_text()
CODE = {".py", ".pyi", ".md", ".typed", ""}
OURS = ("web/page/*", "study/page/*", "export/shaders/*")
"""Folders of this project's own code in other languages, which NOTICE names as a whole."""
SHIPPED = sorted(
    path
    for path in PACKAGE.rglob("*")
    if path.is_file() and path.suffix not in CODE and "__pycache__" not in path.parts
)
WORDS = "you may not resell this data directly, even in converted form"
MODELS = sorted(made.TERMS)


def inside(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def plain(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.parametrize("path", SHIPPED, ids=inside)
def test_each_file_that_ships_is_named_in_notice(path):
    foreign = "three" in path.parts
    if not foreign and any(fnmatch.fnmatch(inside(path), pattern) for pattern in OURS):
        assert path.parent.as_posix().split("src/hemline/")[-1].split("/js")[0] in NOTICE
        return
    assert path.name in NOTICE, f"{inside(path)} ships, and NOTICE does not say on which terms"


def test_notice_names_nothing_that_does_not_ship():
    for name in set(re.findall(r"[\w.-]+\.(?:safetensors|clips|js|wasm|ts|md)\b", NOTICE)) - {"three.js"}:
        assert list(PACKAGE.rglob(name)), f"NOTICE names {name}"
    for path in re.findall(r"src/hemline/[\w./-]+", NOTICE):
        assert (ROOT / path.rstrip(".")).exists(), f"NOTICE names {path}"


@pytest.mark.parametrize("path", sorted((PACKAGE / "models").rglob("*.safetensors")), ids=inside)
def test_each_file_of_data_holds_its_terms(path):
    _, metadata = made.read_contents(path)
    kind, name = metadata["kind"], path.stem
    if kind in ("model", "distance"):
        assert metadata["licences"] == list(made.TERMS[name])
    elif kind == "motions":
        assert {clip["licence"] for clip in metadata["motions"].values()} == {CMU_TERMS}
    elif kind == "garment":
        assert metadata["notes"][0] == made._mesh(name)
    else:
        assert metadata["licence"] == body_made.LICENCE
    assert "free for all uses" not in json.dumps(metadata)


@pytest.mark.parametrize("name", MODELS)
def test_what_was_fitted_to_recordings_says_what_notice_says(name):
    """The paragraph of NOTICE about a file names CMU where the file does, and the file's meshes."""
    (paragraph,) = [plain(each) for each in NOTICE.split("\n\n") if re.search(rf"[ /]{name}\.safetensors", each)]
    terms = " ".join(made.TERMS[name])
    assert (WORDS in terms) == ("CMU" in paragraph) == (name not in ("live", "skinned"))
    assert ("MakeHuman)" in terms or "MakeHuman (" in terms) == ("MakeHuman (CC0 1.0" in paragraph)
    assert ("GarmentCode" in terms) == ("GarmentCode" in paragraph)
    assert "CC0 1.0 Universal" in paragraph and "CC0-1.0" in terms
    assert WORDS in plain(NOTICE)


def test_terms_are_written_without_touching_what_they_are_about():
    """The hash of the body, which each model names, and those of the garments are of arrays and cuts alone."""
    body = bodies.load("anny24")
    for name in (
        "cape",
        "skirt",
        "knee-dress",
        "robe",
        "tshirt-light",
        "longsleeve-light",
        "trousers-light",
        "anny24-sdf",
    ):
        _, metadata = made.read_contents(PACKAGE / "models" / f"{name}.safetensors")
        assert metadata["body"]["hash"] == body.hash
    for name in ("tshirt-light", "longsleeve-light", "trousers-light"):
        assert animators.load(name).garment.hash == garments.load(name).hash
    arrays, metadata = made.read_contents(PACKAGE / "models" / "live.safetensors")
    assert made.add_terms("live", metadata) == metadata
    other = {**metadata, "licences": []}
    assert made.add_terms("live", other) == metadata and content_hash(*arrays.values())


def test_a_clip_that_is_read_by_its_number_has_the_terms_of_its_owner():
    for name in clip_names():
        assert hemline.motions.load(name).licence == CMU_TERMS
    notice = plain((PACKAGE / "models" / "excerpts.NOTICE.md").read_text())
    quoted = CMU_TERMS.split('"')[1]
    assert quoted in plain(NOTICE) and quoted in notice


def test_what_files_of_before_say_is_put_right_on_the_way():
    before = "free for all uses; data from mocap.cs.cmu.edu, created with funding from NSF EIA-0196217"
    assert as_stated(("CC0", before, "", CMU_TERMS, "CC0")) == ("CC0", CMU_TERMS)


def test_a_model_says_what_it_was_made_of(tmp_path):
    before = "free for all uses; data from mocap.cs.cmu.edu, created with funding from NSF EIA-0196217"
    save_model(
        tmp_path / "a.safetensors",
        "stiff",
        {},
        garment=None,
        body={},
        config={},
        figures={},
        licences=["CC0", before],
        extra={},
    )
    assert made.read_contents(tmp_path / "a.safetensors")[1]["licences"] == ["CC0", CMU_TERMS]
    shirt, trousers = animators.load("tshirt-light"), animators.load("trousers-light")
    both = terms_of(animators.together([trousers, shirt]))
    assert set(terms_of(shirt)) | set(terms_of(trousers)) == set(both)
    assert made._mesh("tshirt") in both and CMU_TERMS in both


@pytest.fixture(scope="module")
def shirt_clip():
    body, walk = bodies.load("anny24").shaped(), hemline.motions.load("walk")
    shirt = animators.load("tshirt-light")
    frames = list(hemline.play(shirt, body, walk[:2], pre_roll=0.0))
    return hemline.record(frames, garment_name="tshirt", garment_faces=shirt.garment.faces, motion=walk[:2], fps=30)


def told(path: Path, format_of: str) -> str:
    """What a file says of its terms."""
    if format_of == "glb":
        return pygltflib.GLTF2().load(str(path)).asset.copyright  # type: ignore[union-attr]
    if format_of == "obj":
        return " ".join(line[2:] for line in path.read_text().splitlines() if line.startswith("# "))
    if format_of == "npz":
        with np.load(path, allow_pickle=False) as arrays:
            return " ".join(arrays["notices"])
    if format_of == "vat":
        return " ".join(json.loads(path.with_suffix(".json").read_text())["notices"])
    pytest.importorskip("pxr")
    from pxr import Sdf

    return Sdf.Layer.FindOrOpen(str(path)).customLayerData["notices"]  # type: ignore[attr-defined]


@pytest.mark.parametrize("format_of", ["glb", "obj", "npz", "vat", "usdc"])
def test_what_is_exported_of_a_cmu_clip_carries_all_terms(tmp_path, shirt_clip, format_of):
    if format_of == "usdc":
        pytest.importorskip("pxr")
    written = export.write(tmp_path / f"a.{format_of}", shirt_clip)
    path = next(each for each in written if each.suffix == f".{format_of}" or format_of == "vat")
    said = plain(told(path if format_of != "vat" else tmp_path / "a.json", format_of))
    for text in (body_made.LICENCE, made._mesh("tshirt"), CMU_TERMS, made.OWN, "CMU 06_01"):
        assert plain(text) in said


def test_the_caches_lie_beside_an_obj_that_carries_them(tmp_path, shirt_clip):
    for ending in ("pc2", "mdd"):
        written = export.write(tmp_path / f"{ending}.{ending}", shirt_clip)
        assert any(WORDS in plain(path.read_text()) for path in written if path.suffix == ".obj")


def test_a_garment_of_ones_own_and_another_body_say_theirs(tmp_path):
    """`live` in the dress: its mesh is GarmentCode's; a take of it, too."""
    dress, body = garments.load("dress-light"), bodies.load("anny24").shaped()
    (text,) = garment_terms(dress)
    assert "MIT, (c) 2024 Maria Korosteleva" in text
    walk = body.placed(hemline.motions.load("walk")[:2])
    motion = Motion(walk.rotations, walk.translations, 30.0, walk.leg_length, licence="for tests", source="here")
    take = Take(
        kind="clip",
        vertices=np.stack([dress.vertices] * 2),
        motion=motion,
        betas=body.betas,
        lead_in=np.zeros(2, bool),
        pinched=np.zeros(2, np.int32),
        figures={},
        inputs={},
        failed=None,
    )
    assert record_take(take, dress, body).notices == (body_made.LICENCE, text, "here", "for tests")


def test_a_character_carries_them_too():
    cape = animators.load("cape")
    assert isinstance(cape, AnimatorRopes)
    notices = character(cape, bodies.load("anny24").shaped()).notices
    assert notices[0] == body_made.LICENCE and CMU_TERMS in notices and made.OWN in notices


def test_the_wheel_declares_all_of_them():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["license"] == "Apache-2.0 AND CC0-1.0 AND MIT AND LicenseRef-CMU-Mocap"
    held = {path.relative_to(ROOT).as_posix() for pattern in project["license-files"] for path in ROOT.glob(pattern)}
    wanted = {"LICENSE", "NOTICE"} | {
        path.relative_to(ROOT).as_posix()
        for path in PACKAGE.rglob("*")
        if path.name == "LICENSE" or path.name.endswith("NOTICE.md")
    }
    assert held == wanted
