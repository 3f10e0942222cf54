"""Laws of the commands that judge the clothing shape model, on a shirt that follows a formula."""

import json
from pathlib import Path

import numpy as np
import pytest

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from papers.agentdress import limits, limits_page, shape_page
from papers.agentdress.shape_drapes import Drapes, worn_at
from papers.agentdress.shape_ways import Ways, apart_mm, pushed_out
from tests.animators import dressed_by_formula as made

ROOT = Path(__file__).parents[3]

UNSEEN = np.array([[0.0, 0.0], [1.5, 0.0], [-0.6, 0.9]])


@pytest.fixture(scope="module")
def anchors(tmp_path_factory):
    return AnchorSet.of(made.dataset(tmp_path_factory.mktemp("anchors"), 4))


@pytest.fixture(scope="module")
def ways(anchors):
    pose, fitted = worn_at(anchors, made.body().body, 2)
    unseen = np.array([made.laid(pose, betas) for betas in UNSEEN], np.float64)
    model = fit_anchors(made.shirt(), anchors, AgentDressConfig(), progress=lambda *told: None)
    return Ways.of(Drapes(2, pose, fitted, UNSEEN, unseen), anchors, made.body().body, model)


def test_anchors_in_the_world_are_the_takes(anchors, ways):
    truth = [made.laid(ways.drapes.pose, betas) for betas in anchors.betas]
    np.testing.assert_allclose(ways.drapes.fitted, truth, atol=1e-5)


def test_on_the_mean_shape_nothing_is_moved(ways):
    for worn in (ways.following(UNSEEN), ways.skinned(UNSEEN)):
        np.testing.assert_allclose(worn[0], ways.drapes.fitted[0], atol=1e-6)
        assert apart_mm(worn, ways.drapes.unseen)[1] > 5


def test_what_shapes_do_is_told_by_all_models_and_least_by_skinning(ways):
    errors = {name: float(apart_mm(worn, ways.drapes.unseen).mean()) for name, worn in ways.all().items()}
    told = (
        "coordinates",
        "coordinates, in turned frames",
        "kernel over pose and shape, as played",
        "DRAPE, with squares",
    )
    assert max(errors[name] for name in told) < 0.3 * errors["skinning"]
    assert errors["coordinates"] < errors["coordinates, without squares"]


def test_shares_of_variance_grow_to_one_on_what_was_fitted(ways):
    for name, shares in ways.shares(8).items():
        assert (np.diff(shares) > -1e-12).all() and shares[-1] <= 1 + 1e-9, name
        if name.endswith("fitted"):
            assert shares[-1] == pytest.approx(1, abs=1e-6), name


def test_only_vertices_behind_the_skin_are_pushed_out():
    posed = made.body().posed(made.tpose())
    outside = posed.vertices + 0.01 * posed.normals
    above = np.einsum("vi,vi->v", outside - posed.vertices, posed.normals) > 0
    worn = np.where((np.arange(len(outside)) % 2 == 0)[:, None], outside, posed.vertices - 0.004 * posed.normals)
    found = pushed_out(worn, posed)
    moved = np.linalg.norm(found - worn, axis=1) > 0
    assert moved[1::2].mean() > 0.95 and moved[::2].mean() < 0.05 and above.all()

    def deepest(points):
        apart = np.linalg.norm(points[:, None] - posed.vertices, axis=2)
        nearest = apart.argmin(axis=1)
        return np.einsum("vi,vi->v", points - posed.vertices[nearest], posed.normals[nearest]).min()

    some = np.arange(1, len(worn), len(worn) // 200)
    assert deepest(worn[some]) < -0.003 and deepest(found[some]) > -1e-6


def test_in_the_anchor_s_own_pose_eq_3_is_the_anchor(ways):
    pose, betas = ways.drapes.pose, (-1.0, 1.0)
    bodies = made.body(), made.body().body.shaped(np.array(betas, np.float32))
    rests = made.base(), 1.1 * made.base()
    worn = made.laid(pose), made.laid(pose, betas)
    found = limits.synthesised(made.binding(), bodies, rests, pose, worn, pose, worn[0])
    np.testing.assert_allclose(found, worn[1], atol=1e-6)
    other = made.anchored(made.random_pose(9))
    there = made.laid(other), made.laid(other, betas)
    found = limits.synthesised(made.binding(), bodies, rests, other, there, pose, worn[0])
    assert 0 < np.linalg.norm(found - worn[1], axis=1).mean() < np.linalg.norm(worn[0] - worn[1], axis=1).mean()


def test_the_heaviest_body_is_heavier_than_all_as_far_away_along_one_beta():
    import trimesh

    body, far = made.body().body, np.linalg.norm(limits.FIGURE)
    shapes = {name: np.array(betas) for name, betas in limits.shapes_of(body).items()}
    heaviest, lightest = (limits.volume(body, shapes[name]) for name in ("heaviest", "lightest"))
    assert np.linalg.norm(shapes["heaviest"]) == pytest.approx(far)
    along = [limits.volume(body, sign * far * axis) for axis in np.eye(4) for sign in (-1, 1)]
    assert lightest < limits.volume(body, np.zeros(4)) < heaviest
    assert max(along) <= heaviest * 1.02
    mesh = trimesh.Trimesh(body.shaped(shapes["heaviest"].astype(np.float32)).vertices, body.faces, process=False)
    assert heaviest == pytest.approx(mesh.volume, rel=1e-5)


@pytest.mark.parametrize("name, page", [("shape_models", shape_page.page), ("limits", limits_page.page)])
def test_pages_say_what_was_recorded_last(name, page):
    lines = (ROOT / "benchmarks" / "results" / f"agentdress_{name}.jsonl").read_text().splitlines()
    rows = [row for row in map(json.loads, lines) if row.get("random_betas", 4) == 4]
    assert (ROOT / "papers" / "agentdress" / "pages" / f"{name}.md").read_text() == page(rows[-1])
