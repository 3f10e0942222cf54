"""What a fit keeps beside its model goes when the model is there; what others left there stays."""

import numpy as np

from hemline.animators.checkpoints import clear_checkpoints
from hemline.files import write_tensors


def test_what_a_fit_kept_is_removed_and_nothing_else(tmp_path):
    folder = tmp_path / "model.fitting"
    (folder / "frames").mkdir(parents=True)
    for name, kind in (("coarse", "training"), ("frames/a", "frames"), ("mine", "model")):
        write_tensors(folder / f"{name}.safetensors", {"x": np.zeros(3)}, {"kind": kind})
    (folder / "notes.safetensors").write_text("not ours")
    clear_checkpoints(folder)
    assert sorted(each.name for each in folder.iterdir()) == ["mine.safetensors", "notes.safetensors"]
    (folder / "mine.safetensors").unlink()
    (folder / "notes.safetensors").unlink()
    clear_checkpoints(folder)
    assert not folder.exists()
    clear_checkpoints(folder)  # one that was never made
