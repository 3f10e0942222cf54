"""AgentDress with several materials, on a shirt that follows a formula."""

from dataclasses import replace

import numpy as np
import pytest

import hemline
from hemline import animators, garments, motions
from hemline.animators import MaterialAware
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit import shape_kernel
from hemline.animators.agentdress.kind import KIND
from hemline.animators.agentdress.materials import material_coordinates
from hemline.datasets import Collection, create
from hemline.errors import BadDataset, BadGarment, BadInput, BadModel, HemlineWarning
from hemline.files import read_tensors, write_tensors
from hemline.garments.material import MATERIALS, Material
from hemline.learning.compensated_rounding import PackedWeights
from hemline.motions import Pose
from hemline.playback import Player
from hemline.sim import rest_drape
from hemline.view.stage.catalog import Catalog, Choice
from hemline.web.agentdress_part import agentdress_part
from tests.animators import formula_garment as made

STILL = AgentDressConfig(decay_seconds=0.0)
OWN = made.shirt().material
DENIM, SILK = MATERIALS["denim"], MATERIALS["silk"]
HALF = replace(
    OWN,
    name="half",
    young=float(np.sqrt(OWN.young / OWN.density * DENIM.young / DENIM.density)) * OWN.density,
    bending=float(np.sqrt(OWN.bending / OWN.density * DENIM.bending / DENIM.density)) * OWN.density,
    friction=(OWN.friction + DENIM.friction) / 2,
)
"""Half way to denim in each coordinate."""


def extra(pose: Pose, material: Material) -> np.ndarray:
    """Returns the effect of a material in rotated vertex frames, larger on a raised arm (verts, 3) [m]."""
    stretch, bend = (
        np.log(getattr(material, name) / material.density) - np.log(getattr(OWN, name) / OWN.density)
        for name in ("young", "bending")
    )
    rub = material.friction - OWN.friction
    weights = made.binding().dense_weights()[:, [made.SHOULDER]]
    raised = pose.rotations[made.SHOULDER, 3]
    outward = made.rest_garment() - made.rest_garment().mean(axis=0)
    by_friction = 0.3 * rub * outward[:, [1]] * [0, 1, 0]
    return 0.02 * stretch * outward + 0.06 * bend * raised * weights * outward + by_friction


def garment_in_pose(pose: Pose, material: Material, betas=()) -> np.ndarray:
    shaped = made.body().body.shaped(np.asarray(betas, np.float32))
    offsets = made.formula(pose, betas) + extra(pose, material)
    return made.binding().skin(shaped.posed(pose).transforms, made.rest_garment(), offsets).astype(np.float32)


def lifted_garment(pose: Pose, material: Material, betas=()) -> np.ndarray:
    """Returns the garment in a pose, with the offsets of the pose with lifted arms."""
    shaped = made.body().body.shaped(np.asarray(betas, np.float32))
    lifted = made.anchor_pose(pose)
    offsets = made.formula(lifted, betas) + extra(lifted, material)
    return made.binding().skin(shaped.posed(pose).transforms, made.rest_garment(), offsets).astype(np.float32)


def drape_in(folder, material, numbers, garment=None):
    """Makes a dataset of the shirt in a material, in some poses of the fit."""
    shirt = (garment or made.shirt()).in_material(material)
    dataset = create(folder, shirt)
    for number in numbers:
        pose = made.anchor_pose(made.random_pose(number))
        take = made.anchor(pose)
        dataset.add(
            replace(take, vertices=garment_in_pose(pose, material)[None], inputs={**take.inputs, "garment": shirt.hash})
        )
    return dataset


@pytest.fixture(scope="module")
def anchors(tmp_path_factory):
    return made.make_dataset(tmp_path_factory.mktemp("anchors"), 16, singles=8)


@pytest.fixture(scope="module")
def others(tmp_path_factory):
    folder = tmp_path_factory.mktemp("others")
    return [drape_in(folder / each.name, each, range(0, 24, 2)) for each in (DENIM, SILK)]


@pytest.fixture(scope="module")
def model(anchors, others):
    return KIND.fit(Collection((anchors, *others)), STILL)


def play_pose(model, pose, betas=()):
    posed = made.body().body.shaped(np.asarray(betas, np.float32)).posed(pose)
    return model.step(model.start(posed), posed, 1 / 30)[1]


def mean_mm(one, other):
    return 1e3 * float(np.linalg.norm(one - other, axis=1).mean())


def test_stiffness_and_weight_that_grow_alike_are_the_same_material_to_a_settled_sheet():
    heavier = replace(OWN, density=2 * OWN.density, young=2 * OWN.young, bending=2 * OWN.bending)
    np.testing.assert_allclose(material_coordinates(heavier, OWN), 0, atol=1e-6)
    stiffer = replace(OWN, young=np.e * OWN.young, friction=OWN.friction + 0.1)
    np.testing.assert_allclose(material_coordinates(stiffer, OWN), [2, 0, 1], atol=1e-6)
    limp = replace(OWN, bending=0.0)
    assert np.isfinite(material_coordinates(limp, OWN)).all()


def test_the_simulator_agrees_that_they_are_the_same():
    """Twice the weight and stiffness give the same drape, except for a fold; stiffness alone does not."""
    heavier = replace(OWN, density=2 * OWN.density, young=2 * OWN.young, bending=2 * OWN.bending)
    own, same, stiffer = (
        rest_drape(made.shirt().in_material(each), made.body()).vertices[0]
        for each in (OWN, heavier, replace(heavier, density=OWN.density))
    )
    assert 3 * mean_mm(same, own) < mean_mm(stiffer, own)


@pytest.mark.parametrize("material", [DENIM, SILK, HALF], ids=lambda each: each.name)
def test_materials_are_predicted_in_new_poses_and_on_new_bodies(model, material):
    """`half` was never draped; the kernel interpolates it."""
    told, other = model.in_material(material), model
    for betas in ((), (1.2, -0.6)):
        ours, left_out = [], []
        for number in range(100, 106):
            pose = made.random_pose(number)
            truth = lifted_garment(pose, material, betas)
            ours.append(mean_mm(play_pose(told, pose, betas), truth))
            left_out.append(mean_mm(play_pose(other, pose, betas), truth))
        assert np.mean(ours) < 0.5 * np.mean(left_out)


def not_rounded(weights, inverse):
    """Returns weights as they are, in the place of digits."""
    return PackedWeights(weights, np.ones(len(weights), np.float16), np.ones(weights.shape[1], np.float32))


def test_the_own_material_plays_as_without_others(anchors, others, monkeypatch):
    """Materials share the basis; with enough modes, and numbers that are not rounded, nothing changes."""
    monkeypatch.setattr(shape_kernel, "round_to_digits", not_rounded)
    roomy = replace(STILL, shape_modes=400)
    with_others, alone = KIND.fit(Collection((anchors, *others)), roomy), KIND.fit(anchors, roomy)
    pose = made.random_pose(103)
    assert mean_mm(play_pose(with_others, pose, (1.0,)), play_pose(alone, pose, (1.0,))) < 0.01
    assert with_others.figures["material_change_left_out_mm"] < 0.5 * with_others.figures["material_change_mm"]
    assert "materials" not in alone.figures and alone.materials is None


def test_in_material_can_be_undone(model):
    pose = made.random_pose(101)
    denim = model.in_material("denim")
    assert denim.garment.material == DENIM and denim.in_material(DENIM) is denim
    back = denim.in_material(OWN)
    np.testing.assert_array_equal(play_pose(back, pose), play_pose(model, pose))
    assert mean_mm(play_pose(denim, pose), play_pose(model, pose)) > 1


def test_a_file_keeps_the_material_and_the_others(model, tmp_path):
    pose = made.random_pose(101)
    model.in_material("silk").save(tmp_path / "silk.safetensors")
    read = hemline.load(tmp_path / "silk.safetensors")
    np.testing.assert_array_equal(play_pose(read, pose), play_pose(model.in_material("silk"), pose))
    np.testing.assert_array_equal(play_pose(read.in_material(OWN), pose), play_pose(model, pose))
    assert read.materials.known == ("denim", "silk")


@pytest.mark.parametrize("harm", ["width", "poses", "coordinates", "own"])
def test_a_damaged_file_is_refused(model, tmp_path, harm):
    model.save(tmp_path / "model.safetensors")
    arrays, metadata = read_tensors(tmp_path / "model.safetensors", "model", error=BadModel)
    held = metadata["agentdress"]["materials"]
    if harm == "width":
        held["width"] = -1.0
    if harm == "own":
        del held["own"]
    if harm == "poses":
        arrays["materials.poses"] = arrays["materials.poses"] + np.int32(1000)
    if harm == "coordinates":
        arrays["materials.betas"] = np.ascontiguousarray(arrays["materials.betas"][:, :2])
    write_tensors(tmp_path / "harmed.safetensors", arrays, metadata)
    with pytest.raises(BadModel):
        hemline.load(tmp_path / "harmed.safetensors")


def test_at_lower_detail_and_in_the_player_it_is_the_same_material(model):
    pose, denim = made.random_pose(102), model.in_material("denim")
    level = denim.at_detail(0.5)
    np.testing.assert_allclose(play_pose(level, pose), play_pose(denim, pose)[level.vertex_ids], atol=1e-6)
    player = Player.prepare(denim, made.body())
    _, frame = player.step(player.start(pose), pose, 1 / 30)
    assert mean_mm(frame.animated, play_pose(denim, pose)) < 0.1


def test_unknown_materials_are_refused_or_cause_a_warning(model, anchors, others, tmp_path):
    with pytest.raises(BadInput, match="knows one material, jersey; got denim; drape it in others"):
        KIND.fit(anchors, STILL).in_material("denim")
    with pytest.raises(BadGarment, match="unknown material"):
        model.in_material("velvet")
    with pytest.warns(HemlineWarning, match="was fitted on jersey, denim, silk; .* got paper"):
        model.in_material("paper")
    with pytest.raises(BadInput, match="need kernels as pose and shape model"):
        KIND.fit(Collection((anchors, *others)), replace(STILL, shape_model="blended"))
    with pytest.raises(BadInput, match="need kernels as pose and shape model"):
        KIND.fit(Collection((anchors, *others)), replace(STILL, pose_model="sor"))
    with pytest.raises(BadDataset, match="the first of several datasets has the anchors"):
        KIND.fit(Collection((others[0], anchors)), STILL)
    strange = drape_in(tmp_path / "strange", DENIM, range(40, 44))
    with pytest.raises(BadDataset, match="has no pose of the fit; got 4 others"):
        KIND.fit(Collection((anchors, strange)), STILL)
    moved = replace(made.shirt(), vertices=made.shirt().vertices + np.float32(0.001))
    with pytest.raises(BadDataset, match="is fitted to one garment"):
        KIND.fit(Collection((anchors, drape_in(tmp_path / "moved", DENIM, range(2), moved))), STILL)


def test_which_animators_support_materials():
    assert isinstance(animators.load("live"), MaterialAware)
    assert not isinstance(animators.load("cape"), MaterialAware)
    assert not isinstance(animators.load("lag"), MaterialAware)


def test_live_simulates_the_given_material():
    body = made.body()
    sheet = garments.load("skirt-light")
    told = animators.load("live").in_material("paper").animator_for(sheet, body)
    assert told.garment.material == MATERIALS["paper"]
    plain = animators.load("live").animator_for(sheet, body)
    assert mean_mm(told.rest, plain.rest) > 1


def test_a_garment_of_several_pieces_keeps_their_materials():
    outfit = garments.wear_together([garments.load("tshirt-light"), garments.load("skirt-light")])
    with pytest.raises(BadGarment, match="pieces of different cloth"):
        outfit.in_material(DENIM)


def test_the_viewer_offers_the_materials_of_the_model_and_puts_them_on(model, anchors):
    clip = motions.load("walk")[:6]
    catalog = Catalog({"shirt": lambda: model, "plain": lambda: KIND.fit(anchors, STILL)}, {"walk": lambda: clip})
    assert catalog.materials(Choice("shirt", "walk")) == ("jersey", "denim", "silk")
    assert catalog.materials(Choice("plain", "walk")) == ()
    source = catalog.source(Choice("shirt", "walk", material="silk"))
    assert source.garment.material == SILK and catalog.source(Choice("shirt", "walk")).garment.material == OWN


def test_a_page_without_a_server_plays_the_material_of_the_fit(model):
    with pytest.raises(BadInput, match="plays the material of the fit; got denim; write it of the model in jersey"):
        agentdress_part(model.in_material("denim"), made.body())
    assert not any("materials" in name for name in agentdress_part(model, made.body()).arrays)
