"""`--body FILE`: garment, dataset and export find the body again by its path."""

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.cli import main
from hemline.datasets import open_dataset
from hemline.errors import BadGarment


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bodies.write("other.safetensors", bodies.load())
    return tmp_path


def test_a_garment_is_simulated_and_exported_on_a_body_file(folder):
    cape = garments.make_cape(bodies.load("other.safetensors").shaped(), rows=12, columns=24, name="napkin")
    assert cape.body_name == "other.safetensors"
    cape.save("napkin.safetensors")
    asked = ["-m", "run", "--seconds", "0.1", "--body", "other.safetensors", "-o", "takes"]
    assert main(["simulate", "napkin.safetensors", *asked]) == 0
    assert open_dataset("takes").garment.body_name == "other.safetensors"
    assert main(["export", "takes", "--take", "0", "-o", "a.npz"]) == 0
    with np.load("a.npz") as clip:
        assert clip["body_vertices"].shape[1:] == bodies.load().template.shape


@pytest.mark.parametrize("made, body", [("other.safetensors", "anny24"), ("anny24", "other.safetensors")])
def test_a_garment_of_another_body_is_refused(made, body, folder, capsys):
    garments.make_cape(bodies.load(made).shaped(), rows=12, columns=24).save("napkin.safetensors")
    assert main(["simulate", "napkin.safetensors", "-m", "run", "--body", body, "-o", "takes"]) == 2
    assert f"was made on {made}; got" in capsys.readouterr().err
    assert not (folder / "takes").exists()


@pytest.mark.parametrize("name", ["cape-light", "skirt-light"])
def test_a_garment_by_name_is_made_on_the_body_file(name, folder):
    body = bodies.load("other.safetensors").shaped()
    made, shipped = garments.load(name, body), garments.load(name)
    assert (made.body_name, shipped.body_name) == ("other.safetensors", "anny24")
    assert np.array_equal(made.vertices, shipped.vertices)  # it is the same body by another name
    with pytest.raises(BadGarment, match=f"did you mean '{name}'"):
        garments.load(name[:-1], body)
