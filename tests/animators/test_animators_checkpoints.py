"""What a fit keeps beside its model goes when it is done; what others left there stays."""

import numpy as np
import pytest

from hemline.animators.checkpoints import checkpoint_folder
from hemline.errors import BadOutput
from hemline.files import write_tensors


def fill(folder):
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    for name, kind in (("coarse", "training"), ("frames/a", "frames"), ("mine", "model")):
        write_tensors(folder / f"{name}.safetensors", {"x": np.zeros(3)}, {"kind": kind})
    (folder / "notes.safetensors").write_text("not of a fit")
    (folder / "mapped.npy").write_bytes(b"0")


def names(folder):
    return sorted(str(each.relative_to(folder)) for each in folder.rglob("*") if each.is_file())


def test_what_a_fit_kept_is_removed_when_it_is_done_and_nothing_else(tmp_path):
    with checkpoint_folder(tmp_path / "model.fitting") as folder:
        fill(folder)
    assert names(folder) == ["mine.safetensors", "notes.safetensors"]
    for name in names(folder):
        (folder / name).unlink()
    with checkpoint_folder(folder):
        pass
    assert not folder.exists()


def test_it_stays_when_the_fit_is_broken_off(tmp_path):
    with pytest.raises(KeyboardInterrupt), checkpoint_folder(tmp_path / "model.fitting") as folder:
        fill(folder)
        raise KeyboardInterrupt
    kept = ["coarse.safetensors", "frames/a.safetensors", "mine.safetensors", "notes.safetensors"]
    assert names(tmp_path / "model.fitting") == kept


def test_a_temporary_folder_goes_in_any_case():
    with checkpoint_folder(None) as folder:
        fill(folder)
    assert not folder.exists()


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(BadOutput, match="cannot make .*file/model.fitting.*; name a model in a folder"),
        checkpoint_folder(tmp_path / "file" / "model.fitting"),
    ):
        pass
