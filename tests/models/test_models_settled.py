"""Shipped models of close garments, judged on garments that were settled in poses of people who appear in no fit."""

from pathlib import Path

import numpy as np
import pytest

import hemline
from hemline import bodies
from hemline.files import read_tensors
from hemline.motions.motion import Pose
from papers.agentdress.models.ablations import follow_skin, with_offsets
from papers.agentdress.models.as_played import pose_garment
from papers.agentdress.settled.pairs import Worn, mean_distance_mm

SETTLED = Path(__file__).parent / "settled"
PAPER_MM = 10.6
"""Error of the paper on random bodies (section 4.5), with arms as they are in its anchors."""


def settled_garments(name: str) -> list[Worn]:
    """Returns the settled garments that ship with the tests; `papers.agentdress.settled.samples` made them."""
    arrays, metadata = read_tensors(SETTLED / f"{name}.safetensors", "settled")
    assert metadata["garment"] == hemline.load(name).garment.hash
    vertices = arrays["vertices"] * np.float32(metadata["step"])
    rows = zip(metadata["clips"], arrays["rotations"], arrays["translations"], arrays["betas"], vertices, strict=True)
    return [
        Worn(clip, Pose(rotations, place), tuple(map(float, betas)), garment, 0)
        for clip, rotations, place, betas, garment in rows
    ]


pytestmark = pytest.mark.filterwarnings("ignore:the model of:hemline.errors.HemlineWarning")


@pytest.fixture(scope="module", params=sorted(path.stem for path in SETTLED.glob("*.safetensors")))
def errors(request) -> dict[str, np.ndarray]:
    """Returns the errors on the settled garments as shown, of the model alone, and of dressed skinning [mm]."""
    model = hemline.load(request.param)
    plain, found = with_offsets(model, model.tables.offset), {"shown": [], "model": [], "skinning": [], "mean body": []}
    for worn in settled_garments(request.param):
        shaped = bodies.load(model.body_name).shaped(worn.betas)
        player = hemline.Player.prepare(model, shaped)
        shown = player.step(player.start(worn.pose), worn.pose, 1 / 30)[1].vertices
        skinned = pose_garment(follow_skin(plain, shaped), worn, shaped)
        found["mean body"].append(not any(worn.betas))
        for name, vertices in (
            ("shown", shown),
            ("model", pose_garment(model, worn, shaped)),
            ("skinning", skinned),
        ):
            found[name].append(mean_distance_mm(vertices, worn.vertices))
    return {name: np.array(values) for name, values in found.items()}


def test_the_garments_are_on_the_mean_body_and_on_others(errors):
    assert errors["mean body"].sum() == 5 and len(errors["mean body"]) == 10


def test_what_is_shown_is_nearer_than_the_paper_on_random_bodies_too(errors):
    assert errors["shown"][~errors["mean body"]].mean() < 0.6 * PAPER_MM
    assert errors["shown"][errors["mean body"]].mean() < 0.4 * PAPER_MM


def test_the_model_beats_skinning_that_is_dressed_on_the_same_body(errors):
    assert errors["model"].mean() < 0.6 * errors["skinning"].mean()
    assert (errors["model"] < errors["skinning"]).mean() >= 0.9


def test_the_corrections_of_the_player_do_not_lead_away_from_the_truth(errors):
    assert errors["shown"].mean() < errors["model"].mean() + 0.3
