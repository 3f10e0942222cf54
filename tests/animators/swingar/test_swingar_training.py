"""The terms of the loss by closed forms, and the training in stages on sheets that sway by a formula."""

from dataclasses import replace

import numpy as np
import pytest

from hemline.animators.swingar.estimator_config import EstimatorConfig
from hemline.errors import BadDataset, BadInput
from tests.animators.swingar.swingar_samples import SMALL, sheet
from tests.animators.swingar.swingar_swaying import FRAMES, Swaying

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.animators.swingar.fit import losses  # noqa: E402  # after the skip
from hemline.animators.swingar.fit.estimator import Estimator  # noqa: E402
from hemline.animators.swingar.fit.objectives import CoarseObjective, CorrectiveObjective, Groups  # noqa: E402
from hemline.animators.swingar.fit.train_estimator import STAGES, TrainingPlan, train_estimator  # noqa: E402

CONFIG = EstimatorConfig(**SMALL, body=76, corrective_heads=2)
PLAN = TrainingPlan(
    coarse_epochs=25, term_epochs=2, corrective_epochs=2, epoch=8, garments=1, frames=8, rate=1e-2, warm_up=10
)


def test_terms_are_their_closed_forms():
    truth = torch.from_numpy(sheet()[0])[None]
    moved = truth + torch.tensor([0.0, 0.3, 0.4])
    assert float(losses.distance_loss(moved, truth)) == pytest.approx(0.5)
    edges = torch.tensor([[0, 1], [1, 2]])
    assert float(losses.edge_loss(moved, truth, edges)) == pytest.approx(0, abs=1e-9)
    lengths = (truth[:, edges[:, 0]] - truth[:, edges[:, 1]]).norm(dim=-1)
    assert float(losses.edge_loss(1.5 * truth, truth, edges)) == pytest.approx(float((lengths / 2).square().mean()))
    mass = torch.full((42,), 0.01)
    lifted = losses.gravity_loss(moved, mass) - losses.gravity_loss(truth, mass)
    assert float(lifted) == pytest.approx(9.8 * 0.42 * 0.3, rel=1e-4)
    heights = torch.tensor([[-0.01, 0.001, 0.02]])
    assert float(losses.collision_loss(heights, 0.002)) == pytest.approx((0.012**2 + 0.001**2) / 3)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.5])
def test_bending_is_how_far_normals_are_apart(angle):
    hinge = torch.tensor([[[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [-np.cos(angle), 0, np.sin(angle)]]], dtype=torch.float32)
    faces, beside = torch.tensor([[0, 2, 1], [0, 1, 3]]), torch.tensor([[0, 1]])
    assert float(losses.bend_loss(hinge, faces, beside)) == pytest.approx(2 - 2 * np.cos(angle), abs=1e-5)


def trained(folder, progress=lambda stage, done, total: None, plan=PLAN, samples=None, config=CONFIG, **options):
    samples = samples or Swaying.made()
    return train_estimator(samples, config, plan, seed=1, mark="m", folder=folder, progress=progress, **options)


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    return trained(tmp_path_factory.mktemp("training"))


def test_the_coarse_mesh_learns_to_sway(straight):
    curve = straight.curves[STAGES[0]]
    assert len(curve) == PLAN.coarse_epochs + 1
    assert min(curve) < 0.5 * curve[0]
    assert straight.error <= straight.coarse_error <= min(curve) * 1.5


def test_the_corrective_predictor_is_admitted_only_where_it_is_better(straight):
    assert straight.corrective_admitted == (straight.error < straight.coarse_error)
    assert straight.corrective_admitted or straight.arrays["corrective_scale"] == 0


class Trailing(Swaying):
    """Sheets that are carried to and fro, and trail by how far they were carried in the last two frames."""

    def frames(self, chosen):
        batch, clip, frame = super().frames(chosen), chosen // FRAMES, chosen % FRAMES
        now, before = self.way[clip, 64 + frame], self.way[clip, 64 + np.maximum(frame - 2, 0)]
        transforms, positions = batch.transforms.copy(), self.garments[self.garment_of[chosen[0]]].features[:, 3:6]
        transforms[..., 3] += now[:, None]
        trail = 3 * np.abs(positions).sum(1)[None, :, None] * (now - before)[:, None]
        truth = (positions + now[:, None] - trail).astype(np.float32)
        return replace(batch, motion=np.zeros_like(batch.motion), transforms=transforms, truth=truth)


def test_the_corrective_predictor_learns_what_the_last_three_meshes_tell():
    """Without a coarse stage the coarse mesh is skinning alone, and all of the trailing is left to the other one."""
    alone = replace(PLAN, coarse_epochs=0, term_epochs=0, corrective_epochs=25, frames=16, mirrored=False)
    made = Swaying.made()
    wide = replace(CONFIG, corrective=32)
    found = trained(None, plan=alone, samples=Trailing(made.garments, made.way, made.sway), config=wide)
    assert found.corrective_admitted
    assert found.error < 0.3 * found.coarse_error


def test_killed_in_any_stage_it_comes_to_the_same_bits(straight, tmp_path):
    plan = replace(PLAN, checkpoint_seconds=0.0)
    for stage, epoch in ((STAGES[0], 4), (STAGES[1], 1), (STAGES[2], 1)):

        def stopped(now, done, total, stage=stage, epoch=epoch):
            if (now, done) == (stage, epoch):
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            trained(tmp_path, stopped, plan)
    end = trained(tmp_path, plan=plan)
    assert end.curves == straight.curves
    assert all(np.array_equal(each, straight.arrays[name]) for name, each in end.arrays.items())


def test_it_goes_on_from_weights_that_it_is_given(straight):
    none = replace(PLAN, coarse_epochs=0, term_epochs=0, corrective_epochs=0)
    found = trained(None, plan=none, start=straight.arrays)
    assert found.coarse_error == pytest.approx(straight.coarse_error)


def test_all_terms_are_used_where_the_body_is_known():
    estimator = Estimator(CONFIG)
    found = []
    for wall in (-9.0, 9.0):
        samples = replace(Swaying.made(), wall=wall)
        stage = CoarseObjective(estimator, samples, Groups(4, 2, 2, mirrored=False), losses.LossWeights(collision=1e4))
        found.append(float(stage.loss(np.arange(2), np.random.default_rng(0), slice(None)).detach()))
    assert found[1] > found[0]


def test_features_are_not_looked_at_by_an_estimator_that_has_none():
    estimator, samples = Estimator(CONFIG), Swaying.made()
    groups = Groups(4, 2, 6)
    plain = CoarseObjective(estimator, samples, groups, losses.LossWeights()).errors()

    class WithFeatures(Swaying):
        def frames(self, chosen):
            batch = super().frames(chosen)
            return replace(batch, features=np.full((*batch.truth.shape[:2], 12), 1e6, np.float32))

    given = WithFeatures(samples.garments, samples.way, samples.sway)
    assert CoarseObjective(estimator, given, groups, losses.LossWeights()).errors() == plain


def test_the_present_mesh_of_the_corrective_predictor_is_the_coarse_one():
    torch.manual_seed(0)
    estimator, samples = Estimator(CONFIG), Swaying.made()
    given = estimator, samples, Groups(4, 2, 6), losses.LossWeights()
    stages = CoarseObjective(*given), CorrectiveObjective(*given)
    assert stages[0].errors() == pytest.approx(stages[1].errors(), abs=1e-4)  # its output begins at zero; float16


@pytest.mark.parametrize("name", ["training", "validation"])
def test_an_empty_set_is_refused(name):
    class Empty(Swaying):
        pass

    setattr(Empty, name, property(lambda self: np.zeros(0, np.int64)))
    samples = Swaying.made()
    with pytest.raises(BadDataset, match=f"the {name} set of the estimator is empty; got no samples"):
        trained(None, samples=Empty(samples.garments, samples.way, samples.sway))


def test_a_device_that_is_named_gives_the_same_bits_as_none(straight):
    brief = replace(PLAN, coarse_epochs=2, term_epochs=0, corrective_epochs=1)
    plain, named = trained(None, plan=brief), trained(None, plan=replace(brief, device="cpu"))
    assert plain.curves == named.curves
    assert all(np.array_equal(each, named.arrays[name]) for name, each in plain.arrays.items())


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no CUDA device")
def test_it_learns_the_same_on_cuda(straight):
    there = trained(None, plan=replace(PLAN, device="cuda"))
    assert there.coarse_error == pytest.approx(straight.coarse_error, rel=0.2)


@pytest.mark.parametrize("name", ["abacus", "cuda:99"])
def test_a_device_that_is_not_here_is_refused(name):
    with pytest.raises(BadInput, match=f"must name a device of torch that is here, not '{name}'"):
        trained(None, plan=replace(PLAN, device=name))


def test_no_further_term_of_the_loss_outweighs_distance():
    rest, faces = sheet()
    generator = torch.Generator().manual_seed(0)
    truth = torch.from_numpy(rest)[None]
    moved = (truth + 0.02 * torch.randn(truth.shape, generator=generator)).requires_grad_()
    corners = torch.from_numpy(np.asarray(faces, np.int64))
    edges = torch.cat([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    keys = edges.sort(dim=1).values
    beside = [
        (i % len(faces), j % len(faces)) for i in range(len(keys)) for j in range(i) if (keys[i] == keys[j]).all()
    ]
    weights, mass = losses.LossWeights(), torch.full((len(rest),), 0.3 / len(rest))
    terms = {
        "vertex": losses.distance_loss(moved, truth),
        "edge": losses.edge_loss(moved, truth, edges),
        "bend": losses.bend_loss(moved, corners, torch.tensor(beside)),
        "gravity": losses.gravity_loss(moved, mass),
        "collision": losses.collision_loss(moved[..., 2], 0.002),
    }
    pulls = {
        name: getattr(weights, name) * float(torch.autograd.grad(term, moved, retain_graph=True)[0].norm())
        for name, term in terms.items()
    }
    assert 0 < max(pull for name, pull in pulls.items() if name != "vertex") < 2 * pulls["vertex"], pulls
