"""Quality figures of takes."""

import numpy as np
import pytest

from hemline.meshes import strains
from hemline.sim.cloth.figures import strain_figures


def test_tension_and_compression_are_distinguished(square):
    sheet, x = square(6)
    stretched = (x * [1.1, 1, 0.98]).astype(np.float32)[None]
    strain = strains(stretched, sheet.edges, sheet.edge_length.astype(np.float32))[0]
    along, across = np.ptp(x[sheet.edges][:, :, 2], axis=1) < 1e-9, np.ptp(x[sheet.edges][:, :, 0], axis=1) < 1e-9
    assert strain[along] == pytest.approx(0.1, abs=1e-6)
    assert strain[across] == pytest.approx(-0.02, abs=1e-6)
    figures = strain_figures(sheet, stretched, np.zeros(len(x), bool))
    assert figures["edge_tension_p99"] == pytest.approx(0.1, abs=1e-6)
    assert figures["edge_compression_p99"] == pytest.approx(0.02, abs=1e-6)
    assert figures["edge_strain_p99"] == figures["edge_strain_max"] == pytest.approx(0.1, abs=1e-6)


def test_edges_between_pins_do_not_count(square):
    sheet, x = square(6)
    fixed = np.arange(len(x)) < 30
    moved = np.where(np.arange(len(x))[:, None] < 6, 3 * x, x).astype(np.float32)[None]
    assert strain_figures(sheet, moved, fixed)["edge_strain_max"] < 1e-6
    assert strain_figures(sheet, moved, ~fixed & fixed)["edge_strain_max"] > 1.9


def test_without_stretched_edges_there_is_no_tension(square):
    sheet, x = square(6)
    figures = strain_figures(sheet, (0.5 * x).astype(np.float32)[None], np.zeros(len(x), bool))
    assert figures["edge_tension_p99"] == 0.0
    assert figures["edge_compression_p99"] == pytest.approx(0.5, abs=1e-6)
