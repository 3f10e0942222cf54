"""`hemline evaluate --over`: figures of garments worn over each other."""

import json
from dataclasses import replace

import numpy as np

import hemline
from hemline import bodies, motions, playback
from hemline.animators import together
from hemline.cli.main import main
from hemline.collide import LayersReport
from hemline.metrics import model_mb
from hemline.playback.tally import Tally


def test_it_says_what_is_caught_behind_the_cloth_beneath(capsys):
    told = ["-m", "walk", "--seconds", "0.2", "--json"]
    assert main(["evaluate", "trousers-light", "--over", "tshirt-light", *told]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["caught_percent"] == {"mean": 0.0, "worst_frame": 0.0}, "in a walk nothing is between legs"
    sizes = [model_mb(hemline.animators.model_path(name)) for name in ("trousers-light", "tshirt-light")]
    assert figures["model_mb"] == sum(sizes)


def test_caught_vertices_are_counted_of_all():
    both, body = (
        together([hemline.load("trousers-light"), hemline.load("tshirt-light")]),
        bodies.load("anny24").shaped(),
    )
    tally, frames = Tally(both), playback.play(both, body, motions.load("walk")[:3], fps=30)
    for count, frame in zip((7, 0), frames, strict=False):
        assert isinstance(frame.report, LayersReport)
        tally.add(replace(frame, report=replace(frame.report, caught=np.arange(count, dtype=np.int32))), None, 30)
    share = 100 * 7 / len(both.garment.vertices)
    assert tally.figures()["caught_percent"] == {"mean": share / 2, "worst_frame": share}


def test_one_garment_alone_has_nothing_to_be_caught_behind(capsys):
    assert main(["evaluate", "tshirt-light", "-m", "walk", "--seconds", "0.1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["caught_percent"] is None


def test_a_garment_over_itself_and_a_wrong_thickness_are_refused(capsys):
    told = ["evaluate", "trousers-light", "-m", "walk", "--over"]
    assert main([*told, "trousers-light"]) == 2
    assert "cannot be worn over itself; got 'trousers-light' twice" in capsys.readouterr().err
    assert main([*told, "tshirt-light", "--thickness-mm", "20"]) == 2
    assert "garments lie above 0 and at most 10 mm over each other; got thickness_mm = 20" in capsys.readouterr().err
