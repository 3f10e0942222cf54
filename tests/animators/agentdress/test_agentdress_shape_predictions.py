"""Laws of the experiments on the clothing shape model, on a shirt that follows a formula; and the recorded pages."""

import numpy as np
import pytest

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from papers.agentdress import limits
from papers.agentdress.models.shape_predictions import Drapes, ShapePredictions, anchor_drapes, distances_mm, push_out
from papers.agentdress.report import summary
from papers.report import Page
from tests.animators import formula_garment as made

UNSEEN = np.array([[0.0, 0.0], [1.5, 0.0], [-0.6, 0.9]])


@pytest.fixture(scope="module")
def anchors(tmp_path_factory):
    return AnchorSet.of(made.make_dataset(tmp_path_factory.mktemp("anchors"), 4))


@pytest.fixture(scope="module")
def scene(anchors):
    pose, fitted = anchor_drapes(anchors, made.body().body, 2)
    unseen = np.array([made.garment_in_pose(pose, betas) for betas in UNSEEN], np.float64)
    model = fit_anchors(made.shirt(), anchors, AgentDressConfig(), progress=lambda *stage: None)
    return ShapePredictions(Drapes(2, pose, fitted, UNSEEN, unseen), anchors, made.body().body, model)


def test_anchors_in_the_world_are_the_takes(anchors, scene):
    truth = [made.garment_in_pose(scene.drapes.pose, betas) for betas in anchors.betas]
    np.testing.assert_allclose(scene.drapes.fitted, truth, atol=1e-5)


def test_nothing_moves_on_the_mean_shape(scene):
    for worn in (scene.following_skin(UNSEEN), scene.following_joints(UNSEEN)):
        np.testing.assert_allclose(worn[0], scene.drapes.fitted[0], atol=1e-6)
        assert distances_mm(worn, scene.drapes.unseen)[1] > 5


def test_all_models_predict_the_effect_of_shapes_and_skinning_the_least(scene):
    errors = {name: float(distances_mm(worn, scene.drapes.unseen).mean()) for name, worn in scene.predict_all().items()}
    models = (
        "coordinates",
        "coordinates, in turned frames",
        "kernel over pose and shape, as played",
        "DRAPE, with squares",
    )
    assert max(errors[name] for name in models) < 0.3 * errors["skinning"]
    assert errors["coordinates"] < errors["coordinates, without squares"]


def test_explained_variance_grows_to_one_on_training_garments(scene):
    for name, fractions in scene.explained_variance(8).items():
        assert (np.diff(fractions) > -1e-12).all() and fractions[-1] <= 1 + 1e-9, name
        if name.endswith("fitted"):
            assert fractions[-1] == pytest.approx(1, abs=1e-6), name


def test_only_vertices_behind_the_skin_are_pushed_out():
    posed = made.body().posed(made.t_pose())
    outside = posed.vertices + 0.01 * posed.normals
    above = np.einsum("vi,vi->v", outside - posed.vertices, posed.normals) > 0
    worn = np.where((np.arange(len(outside)) % 2 == 0)[:, None], outside, posed.vertices - 0.004 * posed.normals)
    found = push_out(worn, posed)
    moved = np.linalg.norm(found - worn, axis=1) > 0
    assert moved[1::2].mean() > 0.95 and moved[::2].mean() < 0.05 and above.all()

    def deepest(points):
        apart = np.linalg.norm(points[:, None] - posed.vertices, axis=2)
        nearest = apart.argmin(axis=1)
        return np.einsum("vi,vi->v", points - posed.vertices[nearest], posed.normals[nearest]).min()

    some = np.arange(1, len(worn), len(worn) // 200)
    assert deepest(worn[some]) < -0.003 and deepest(found[some]) > -1e-6


def test_in_the_anchor_s_own_pose_eq_3_is_the_anchor(scene):
    pose, betas = scene.drapes.pose, (-1.0, 1.0)
    bodies = made.body(), made.body().body.shaped(np.array(betas, np.float32))
    rests = made.rest_garment(), 1.1 * made.rest_garment()
    worn = made.garment_in_pose(pose), made.garment_in_pose(pose, betas)
    found = limits.synthesise(made.binding(), bodies, rests, pose, worn, pose, worn[0])
    np.testing.assert_allclose(found, worn[1], atol=1e-6)
    other = made.anchor_pose(made.random_pose(9))
    there = made.garment_in_pose(other), made.garment_in_pose(other, betas)
    found = limits.synthesise(made.binding(), bodies, rests, other, there, pose, worn[0])
    assert 0 < np.linalg.norm(found - worn[1], axis=1).mean() < np.linalg.norm(worn[0] - worn[1], axis=1).mean()


def test_the_heaviest_body_is_heavier_than_all_as_far_away_along_one_beta():
    import trimesh

    body, far = made.body().body, np.linalg.norm(limits.FIG13_BETAS)
    shapes = {name: np.array(betas) for name, betas in limits.shapes_of(body).items()}
    heaviest, lightest = (limits.volume(body, shapes[name]) for name in ("heaviest", "lightest"))
    assert np.linalg.norm(shapes["heaviest"]) == pytest.approx(far)
    along = [limits.volume(body, sign * far * axis) for axis in np.eye(4) for sign in (-1, 1)]
    assert lightest < limits.volume(body, np.zeros(4)) < heaviest
    assert max(along) <= heaviest * 1.02
    mesh = trimesh.Trimesh(body.shaped(shapes["heaviest"].astype(np.float32)).vertices, body.faces, process=False)
    assert heaviest == pytest.approx(mesh.volume, rel=1e-5)


def test_pages_are_those_of_the_recorded_rows(monkeypatch):
    pages = {}
    monkeypatch.setattr(Page, "write", lambda page, path: pages.setdefault(path, page.render()))
    summary.write_pages()
    assert len(pages) > 12
    for path, text in pages.items():
        assert path.read_text() == text, path.name


def test_a_cell_holds_one_number():
    page = Page("Title").table({"name": "", "error, mm": ".1f"}, [("first", 1.26), ("second", None), ("third", np.nan)])
    assert page.render().splitlines()[-3:] == ["| first | 1.3 |", "| second |  |", "| third |  |"]
    with pytest.raises(TypeError, match="1.3; 2.1"):
        page.table({"error, mm": ".1f"}, [("1.3; 2.1",)])
    with pytest.raises(ValueError):
        page.table({"name": "", "error, mm": ".1f"}, [("first",)])
