"""The training loop: resumed to the same bits from any epoch, the best epoch kept."""

import math

import numpy as np
import pytest

from hemline.errors import BadModel, HemlineWarning
from hemline.files import read_tensors, write_tensors

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer  # noqa: E402  # after the skip

EPOCHS = 12


class Line:
    """A linear map, learnt from 50 noisy samples; each batch draws noise of its own."""

    name = "line"

    def __init__(self):
        random = np.random.default_rng(7)
        self.inputs = random.normal(size=(50, 4)).astype(np.float32)
        self.outputs = (self.inputs @ random.normal(size=(4, 2)) + 0.1 * random.normal(size=(50, 2))).astype(np.float32)
        self.weight = torch.zeros(4, 2, requires_grad=True)
        self.offset = torch.zeros(2, requires_grad=True)
        self.seen: list[np.ndarray] = []

    @property
    def parameters(self):
        return [self.weight, self.offset]

    @property
    def samples(self):
        return np.arange(40)

    def loss(self, chosen, random, mine):
        self.seen.append(chosen)
        noise = 0.2 * random.normal(size=(len(chosen), 4)).astype(np.float32)
        found = torch.from_numpy((self.inputs[chosen] + noise)[mine]) @ self.weight + self.offset
        return ((found - torch.from_numpy(self.outputs[chosen[mine]])) ** 2).mean()

    def validation_loss(self, random):
        held_out = np.arange(40, 50)
        found = torch.from_numpy(self.inputs[held_out]) @ self.weight + self.offset
        return ((found - torch.from_numpy(self.outputs[held_out])) ** 2).mean()

    def bits(self) -> bytes:
        return b"".join(p.detach().numpy().tobytes() for p in self.parameters)


SCHEDULE = Schedule(epochs=EPOCHS, batch=16, rate=0.05, seed=3, threads=1)


def trained(line, checkpoint=None, progress=lambda done, total: None, schedule=SCHEDULE):
    Trainer(line, schedule).run(checkpoint=checkpoint, progress=progress)
    return line


@pytest.fixture(scope="module")
def straight() -> bytes:
    return trained(Line()).bits()


@pytest.mark.parametrize("every", [1, 5])
@pytest.mark.parametrize("epoch", range(1, EPOCHS + 1))
def test_stopped_after_any_epoch_it_comes_to_the_same_bits(straight, tmp_path, epoch, every):
    checkpoint = Checkpoint(tmp_path / "line.safetensors", "mark", every)

    def stopped(done, total):
        if done == epoch:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trained(Line(), checkpoint, stopped)
    seen: list[int] = []
    end = trained(Line(), checkpoint, lambda done, total: seen.append(done))
    assert end.bits() == straight
    assert len(seen) == (0 if epoch == EPOCHS else EPOCHS - epoch // every * every)


@pytest.mark.parametrize("step", [1, 4, 20])
def test_killed_within_an_epoch_it_comes_to_the_same_bits(straight, tmp_path, step):
    class Killed(Line):
        def loss(self, chosen, random, mine):
            if len(self.seen) == step:
                raise KeyboardInterrupt
            return super().loss(chosen, random, mine)

    checkpoint = Checkpoint(tmp_path / "line.safetensors", "mark", 2)
    with pytest.raises(KeyboardInterrupt):
        trained(Killed(), checkpoint)
    assert trained(Line(), checkpoint).bits() == straight


def test_a_process_that_is_killed_leaves_a_whole_checkpoint(straight, tmp_path):
    import os
    import subprocess
    import sys
    from pathlib import Path

    code = (
        "import os, signal\n"
        "from pathlib import Path\n"
        "from tests.learning.test_learning_trainer import Checkpoint, Line, trained\n"
        "def kill(done, total):\n"
        "    if done == 7: os.kill(os.getpid(), signal.SIGKILL)\n"
        f"trained(Line(), Checkpoint(Path({str(tmp_path)!r}) / 'line.safetensors', 'mark', 3), kill)\n"
    )
    places = [str(Path(__file__).parent), *sys.path]
    done = subprocess.run([sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": os.pathsep.join(places)})
    assert done.returncode == -9
    checkpoint = Checkpoint(tmp_path / "line.safetensors", "mark", 3)
    assert read_tensors(checkpoint.path, "training")[1]["done"] == 6
    assert trained(Line(), checkpoint).bits() == straight


def test_a_checkpoint_with_another_mark_is_not_used(straight, tmp_path):
    path = tmp_path / "line.safetensors"
    trained(Line(), Checkpoint(path, "another", 1), schedule=Schedule(2, 16, 0.5, 9, 1))
    assert trained(Line(), Checkpoint(path, "mark", 1)).bits() == straight


def _cut(path) -> None:
    path.write_bytes(path.read_bytes()[:-9])


def _changed(path, arrays=(), **numbers) -> None:
    kept, metadata = read_tensors(path, "training")
    write_tensors(path, kept | dict(arrays), metadata | numbers)


DAMAGES = {
    "cut off": _cut,
    "empty": lambda path: path.write_bytes(b""),
    "pickled": lambda path: torch.save({"weight": torch.zeros(2)}, path),
    "of another shape": lambda path: _changed(path, {"parameter0": np.zeros((1, 2), np.float32)}),
    "of another type": lambda path: _changed(path, {"first1": np.zeros(2)}),
    "without one of a pair": lambda path: _changed(path, {"first2": np.zeros(2, np.float32), "best1": np.zeros(0)}),
    "with a word for a number": lambda path: _changed(path, done="all"),
    "with less than nothing done": lambda path: _changed(path, done=-1),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_checkpoint_is_put_aside_and_the_training_begins_anew(straight, tmp_path, name):
    path = tmp_path / "line.safetensors"
    for _ in range(2):
        trained(Line(), Checkpoint(path, "mark", 1))
        DAMAGES[name](path)
        damaged = path.read_bytes()
        seen: list[int] = []
        with pytest.warns(HemlineWarning, match="the checkpoint .*line.safetensors is damaged; .*begins anew"):
            end = trained(Line(), Checkpoint(path, "mark", 1), lambda done, total, told=seen: told.append(done))
        assert end.bits() == straight and len(seen) == EPOCHS
        assert (tmp_path / "line.safetensors.damaged").read_bytes() == damaged
        assert trained(Line(), Checkpoint(path, "mark", 1)).bits() == straight


def test_a_checkpoint_that_cannot_be_read_stays_and_the_cure_is_said(tmp_path):
    path = tmp_path / "line.safetensors"
    path.mkdir()
    with pytest.raises(BadModel, match=r"the checkpoint .* cannot be used; got a folder; make it readable, or delete"):
        trained(Line(), Checkpoint(path, "mark", 1))
    path.rmdir()
    write_tensors(path, {}, {"kind": "training", "mark": "mark", "format": 99})
    before = path.read_bytes()
    with pytest.raises(BadModel, match="cannot be used; got version 99; .* delete .*line.safetensors"):
        trained(Line(), Checkpoint(path, "mark", 1))
    assert path.read_bytes() == before


def test_single_numbers_and_parameters_without_a_gradient_outlive_a_kill(tmp_path):
    class Scaled(Line):
        def __init__(self):
            super().__init__()
            self.scale, self.unused = torch.ones((), requires_grad=True), torch.ones(3, requires_grad=True)

        @property
        def parameters(self):
            return [self.weight, self.offset, self.scale, self.unused]

        def loss(self, chosen, random, mine):
            return self.scale**2 * super().loss(chosen, random, mine)

    def stopped(done, total):
        if done == 5:
            raise KeyboardInterrupt

    checkpoint, whole = Checkpoint(tmp_path / "line.safetensors", "mark", 1), trained(Scaled())
    with pytest.raises(KeyboardInterrupt):
        trained(Scaled(), checkpoint, stopped)
    assert trained(Scaled(), checkpoint).bits() == whole.bits()


def test_every_sample_is_shown_once_an_epoch_in_another_order_each_time():
    line = trained(Line())
    batches = math.ceil(40 / 16)
    assert len(line.seen) == EPOCHS * batches
    epochs = [line.seen[i : i + batches] for i in range(0, len(line.seen), batches)]
    for epoch in epochs:
        np.testing.assert_array_equal(np.sort(np.concatenate(epoch)), np.arange(40))
    assert any((one != two).any() for one, two in zip(epochs[0], epochs[1], strict=True))


def test_the_seed_says_all(straight):
    assert trained(Line()).bits() == straight
    assert trained(Line(), schedule=Schedule(EPOCHS, 16, 0.05, 4, 1)).bits() != straight


def test_the_epoch_with_the_least_validation_loss_is_kept():
    class Remembering(Line):
        def __init__(self):
            super().__init__()
            self.losses, self.states = [], []

        def validation_loss(self, random):
            # asks for half of what the training asks for: the way from zero to the whole passes it
            found = torch.from_numpy(self.inputs) @ self.weight + self.offset
            loss = ((found - 0.5 * torch.from_numpy(self.outputs)) ** 2).mean()
            self.losses.append(float(loss))
            self.states.append(self.bits())
            return loss

    line = trained(Remembering(), schedule=Schedule(EPOCHS, 16, 0.1, 3, 1))
    assert len(line.losses) == EPOCHS + 1
    best = int(np.argmin(line.losses))
    assert 0 < best < EPOCHS
    assert line.bits() == line.states[best]


def test_it_learns_the_line():
    line = trained(Line(), schedule=Schedule(300, 40, 0.05, 3, 1))
    design = np.column_stack([line.inputs[:40], np.ones(40)])
    exact = np.linalg.lstsq(design, line.outputs[:40], rcond=None)[0]
    # noise of 0.2 on inputs of unit size shrinks the map by 4 %
    np.testing.assert_allclose(line.weight.detach().numpy(), exact[:4], atol=0.12)


def test_the_mean_loss_of_each_epoch_is_kept_and_outlives_a_kill(tmp_path):
    checkpoint = Checkpoint(tmp_path / "line.safetensors", "mark", 1)
    whole = Trainer(Line(), SCHEDULE)
    whole.run(progress=lambda done, total: None)
    assert len(whole.batch_losses) == EPOCHS and whole.batch_losses[-1] < whole.batch_losses[0]

    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Trainer(Line(), SCHEDULE).run(checkpoint=checkpoint, progress=stop)
    again = Trainer(Line(), SCHEDULE)
    again.run(checkpoint=checkpoint, progress=lambda done, total: None)
    np.testing.assert_array_equal(again.batch_losses, whole.batch_losses)


def test_the_rate_falls_along_a_cosine():
    line, rates = Line(), []
    trainer = Trainer(line, SCHEDULE)
    trainer.run(progress=lambda done, total: rates.append(trainer.adam.param_groups[0]["lr"]))
    np.testing.assert_allclose(rates, 0.025 * (1 + np.cos(np.pi * np.arange(EPOCHS) / EPOCHS)), rtol=1e-12)


def test_a_loss_that_is_not_finite_is_said():
    class Diverging(Line):
        def loss(self, chosen, random, mine):
            return super().loss(chosen, random, mine) * float("inf")

    with pytest.raises(BadModel, match="the training of the line diverged; got a loss that is not finite; lower"):
        trained(Diverging())


def test_warm_up_and_clipping_shorten_the_first_steps(tmp_path):
    def moved(**options) -> float:
        line = Line()
        Trainer(line, Schedule(epochs=1, batch=40, rate=0.05, seed=3, threads=1, **options))._run_epoch()
        return float(line.weight.detach().abs().max())

    assert moved(warm_up=10) == pytest.approx(moved() / 10, rel=1e-4)
    assert moved(clip=1e-9) < 0.99 * moved()  # Adam divides by the length, up to its epsilon


def test_it_ends_once_the_validation_loss_has_stopped_falling(tmp_path):
    patient = Schedule(epochs=400, batch=16, rate=0.05, seed=3, threads=1, patience=10)
    checkpoint, seen = Checkpoint(tmp_path / "line.safetensors", "mark", 5), []
    whole = trained(Line(), checkpoint, lambda done, total: seen.append(done), patient)
    assert 10 < len(seen) < 400
    again: list[int] = []
    assert trained(Line(), checkpoint, lambda done, total: again.append(done), patient).bits() == whole.bits()
    assert again == []


def test_a_checkpoint_waits_for_its_time_but_not_at_the_end(straight, tmp_path):
    checkpoint = Checkpoint(tmp_path / "line.safetensors", "mark", 1, seconds=3600.0)

    def stopped(done, total):
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trained(Line(), checkpoint, stopped)
    assert not checkpoint.path.exists()
    assert trained(Line(), checkpoint).bits() == straight
    assert len(read_tensors(checkpoint.path, "training", error=BadModel)[0]["losses"]) == EPOCHS + 1
