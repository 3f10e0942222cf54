"""The animator that `hemline fit` takes if none is named."""

from dataclasses import replace

import pytest

from hemline import datasets
from hemline.animators.suited import suited_animator
from hemline.cli.main import options_class
from tests.datasets.dataset_samples import make_garment, make_take


def made(folder, name, kind):
    """A dataset of one take of a garment of that name."""
    garment = replace(make_garment(), name=name)
    dataset = datasets.create(folder, garment)
    dataset.add(replace(make_take(garment, frames=3 if kind == "clip" else 1), kind=kind))
    return dataset


@pytest.mark.parametrize(
    ("held", "animator"),
    [
        ([], "ropes"),
        ([("coat", "clip")], "ropes"),
        ([("coat", "anchor")], "agentdress"),
        ([("coat", "anchor"), ("coat", "clip")], "agentdress"),
        ([("coat", "clip"), ("gown", "clip")], "lag"),
    ],
)
def test_what_datasets_hold_decides(tmp_path, held, animator):
    found = [made(tmp_path / str(number), *each) for number, each in enumerate(held)]
    assert suited_animator(found) == animator
    words = [str(dataset.folder) for dataset in found]
    config = options_class("fit", words).__dataclass_fields__["config"].default_factory()
    assert (
        type(config).__name__
        == {"ropes": "RopesConfig", "agentdress": "AgentDressConfig", "lag": "LagConfig"}[animator]
    )


def test_a_named_animator_is_taken_whatever_datasets_hold(tmp_path):
    words = [str(made(tmp_path, "coat", "clip").folder), "--animator", "agentdress"]
    config = options_class("fit", words).__dataclass_fields__["config"].default_factory()
    assert type(config).__name__ == "AgentDressConfig"
