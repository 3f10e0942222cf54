"""Shipped weights on a garment, a body and a clip that no fit saw, beside skinning and the simulation."""

import numpy as np
import pytest

from hemline import animators, bodies, garments, motions
from hemline.animators.coarse.features.trail import Trail
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.animators.coarse.wearable import CoarseWearable
from hemline.sim import SimSettings, rest_drape, simulate

SHIPPED = [name for name in ("lag", "swingar") if name in animators.shipped_models()]
BETAS = (0.6, -0.8, 0.5)


@pytest.fixture(scope="module")
def unseen():
    """Two seconds of a dress, simulated offline, and how far each vertex is from skinning, in its turned frame."""
    body = bodies.load("anny24").shaped(BETAS)
    dress = garments.load("dress:100@35").dressed(body)
    settings = SimSettings()
    rest = rest_drape(dress, body, settings)
    take = simulate(dress, body, body.placed(motions.load("turn"))[:60], settings, start=rest)
    proxy = ProxyOnBody.of(dress, rest.vertices[0], body)
    return take, dress, [each for each, _ in _along(proxy, take, take.vertices)]


def _along(proxy, take, vertices):
    """From where skinning puts each vertex in each frame of the clip, in its turned frame: vertices, and zero."""
    trail = Trail.start(proxy, proxy.shaped.posed(take.motion[0]))
    for frame in range(1, len(take.motion)):
        posed = proxy.shaped.posed(take.motion[frame])
        trail = trail.advance(proxy, posed, 1 / take.motion.fps)
        if not take.lead_in[frame]:
            yield trail.local_offsets(vertices[frame]), trail


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_weights_swing_as_the_simulation_does(name, unseen):
    take, dress, truth = unseen
    model, body = animators.load(name), bodies.load("anny24").shaped(BETAS)
    assert isinstance(model, CoarseWearable) and "dress-100" not in model.weights.relatives.names
    worn = model.animator_for(dress, body)
    state = worn.start(body.posed(take.motion[0]))
    played = [take.vertices[0]]
    for frame in range(1, len(take.motion)):
        state, vertices = worn.step(state, body.posed(take.motion[frame]), 1 / take.motion.fps)
        played.append(vertices)
    proxy = ProxyOnBody.of(dress, rest_drape(dress, body, SimSettings()).vertices[0], body)
    found = np.array([each for each, _ in _along(proxy, take, np.array(played))])
    wanted = np.array(truth)
    error, skinned = (np.linalg.norm(each, axis=2).mean() for each in (found - wanted, wanted))
    assert error < 0.7 * skinned, f"{1e3 * error:.1f} mm, skinned {1e3 * skinned:.1f}"
    swings = [(each - each.mean(axis=0)).ravel() for each in (found, wanted)]
    assert np.corrcoef(*swings)[0, 1] > 0.5


@pytest.mark.slow
def test_another_garment_of_the_kind_is_among_the_most_similar_ones():
    """Of the garments that `lag` was fitted to, by which the reach of the descriptor was not chosen."""
    from hemline.animators.coarse.features.descriptor import compress_eigenvalues

    known = animators.load("lag").weights.relatives
    kinds = np.array([next(part for part in name.split("-") if part not in ("slim", "close")) for name in known.names])
    values = compress_eigenvalues(known.eigenvalues)
    apart = np.linalg.norm(values[:, None] - values[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    counted = np.isin(kinds, ("top", "dress", "skirt", "trousers", "jumpsuit"))
    same = kinds[apart.argmin(axis=1)] == kinds
    assert same[counted].mean() >= 0.85
