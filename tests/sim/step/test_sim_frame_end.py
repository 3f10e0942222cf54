"""The end of a frame: vertices that are pushed out of the body, and those that stay between two of its parts."""

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.collide import winding_numbers
from hemline.sim.step.frame_end import COUNT_INTERVAL, MAX_PINCHED_MOVE, FrameEnd
from tests.sim.sim_poses import kick_motion


@pytest.fixture(scope="module")
def folded():
    """A body whose left heel is at the seat, and points in and around that leg with the faces of its skin nearest to
    them at rest: some inside, some inside thigh and calf at once.
    """
    shaped = bodies.load("anny24").shaped()
    posed = shaped.posed(kick_motion(shaped, 3)[1])
    rng = np.random.default_rng(8)
    legs = np.flatnonzero(shaped.vertices[:, 1] < shaped.joints[1, 1])
    faces = np.flatnonzero(np.isin(shaped.body.faces, legs[shaped.vertices[legs, 0] > 0]).all(axis=1))
    face = rng.choice(faces, 3000)
    on_skin = posed.vertices[shaped.body.faces[face]].mean(axis=1)
    inward = posed.normals[shaped.body.faces[face]].mean(axis=1)
    points = on_skin - rng.uniform(-0.005, 0.03, (3000, 1)) * inward
    return shaped, posed, points, face.astype(np.int32)


@pytest.fixture(scope="module")
def cleaned(folded):
    shaped, posed, points, face = folded
    trousers = garments.load("trousers-light")
    vertices, places = trousers.vertices.astype(np.float64), np.full((len(trousers.vertices), 2), -1, np.int32)
    vertices[: len(points)], places[: len(points), 0] = points, face
    end, projector = FrameEnd(trousers, shaped), None
    for _ in range(COUNT_INTERVAL):
        result = end.clean(posed, vertices, 1 / 30, places, projector=projector)
        projector = result.projector
    assert result.inside == 0, "counted in every so many frames"
    count = len(points)
    pinned = np.isin(np.arange(count), result.pinched)
    return points, result.positions[:count], pinned, winding_numbers(posed.vertices, posed.faces, points), posed


def test_what_is_between_two_parts_is_not_led_far(cleaned):
    before, after, pinched, turns, _ = cleaned
    moved, between = np.linalg.norm(after - before, axis=1), turns >= 2
    assert between.sum() > 100
    assert moved[between].max() < MAX_PINCHED_MOVE + 1e-6
    # what is near a way out is led out there as well
    assert ((moved > 0) & ~pinched & between).any()
    stays = between & pinched
    assert stays.sum() > 20 and np.abs(after - before)[stays].max() < 1e-6


def test_what_is_in_one_part_is_led_out_however_far(cleaned):
    before, after, pinched, turns, posed = cleaned
    moved, alone = np.linalg.norm(after - before, axis=1), (turns == 1) & ~pinched
    assert (moved[alone] > 1.5 * MAX_PINCHED_MOVE).sum() > 20
    assert not winding_numbers(posed.vertices, posed.faces, after[~pinched]).any()
