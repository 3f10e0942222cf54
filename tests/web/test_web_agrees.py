"""Vertices of the page are those of Python, stage by stage, in Chromium; the same again and again."""

from dataclasses import replace

import numpy as np
import pytest

import hemline
from hemline import web
from hemline.collide import inside
from hemline.learning.mlp import Mlp
from hemline.meshes import rest_lengths, vertex_normals
from hemline.playback import play
from tests.web.web_pages import farthest_mm, opened, played

# after web_pages, which names their folder
from tests.contract.made_models import agentdress_model, body, ropes_model, walk  # isort: skip

WITHIN_MM = 0.1
BETAS = (1.5, -1.0, 0.5)


def with_constants(model, **changed):
    ropes = model.ropes
    return replace(model, ropes=ropes.with_constants(replace(ropes.constants, **changed)))


def made() -> dict:
    """Every way that a page knows: contact, tensions, springs; maps."""
    ropes, shirt = ropes_model(), agentdress_model()
    blended = replace(shirt, config=replace(shirt.config, shape_model="blended"))
    inputs, modes = 3 * ropes.ropes.node_count, ropes.skinning_basis.mode_count
    matrix = np.random.default_rng(4).normal(size=(modes, inputs)) / np.sqrt(inputs)
    return {
        "ropes": ropes,
        "linear": replace(ropes, skinning=Mlp.from_weights([matrix], [np.zeros(modes)])),
        "windy": with_constants(ropes, wind=(1.0, 0.0, -3.0), rest_angle=20.0, friction=1.0),
        "swept": with_constants(ropes, tension_sweeps=6, impulse_sweeps=6, position_update="project"),
        "back along the path": with_constants(ropes, position_push="history", velocity_push="history"),
        "up the gradient": with_constants(ropes, position_push="gradient", substep=1 / 240, balance_reach=0.0),
        "shirt": shirt,
        "blended": blended,
    }


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "made.html"
    clips = {"walk": walk(), "leap": leap(), "slow": walk(fps=50.0)}
    web.write_page(path, web.page_contents(made(), clips, body()), title="made")
    with opened(path.as_uri()) as page:
        yield page


def leap():
    """A walk in which the body is put five metres aside."""
    motion = walk()
    aside = np.zeros_like(motion.translations)
    aside[15:, 0] = 5.0
    return replace(motion, translations=motion.translations + aside)


@pytest.mark.parametrize("name", made())
def test_each_animator_plays_as_in_python(page, name):
    index, model = list(made()).index(name), made()[name]
    found, skin, _ = page.frames(index, 25)
    frames = played(model, body(), walk(), 25)
    assert farthest_mm(found, frames) < WITHIN_MM
    assert max(np.abs(one - other.body.vertices).max() for one, other in zip(skin, frames, strict=True)) < 1e-6


@pytest.mark.parametrize("name", ["ropes", "windy", "shirt"])
def test_a_body_that_is_put_elsewhere_takes_its_garment_along(page, name):
    found, _, _ = page.frames(list(made()).index(name), 25, clip=1)
    assert farthest_mm(found, played(made()[name], body(), leap(), 25)) < WITHIN_MM


def test_a_clip_of_another_rate_is_played_at_thirty_frames_a_second(page):
    found, _, _ = page.frames(0, 20, clip=2)
    frames = played(ropes_model(), body(), body().placed(walk(fps=50.0).resample(30.0)), 20)
    assert farthest_mm(found, frames) < WITHIN_MM


@pytest.mark.parametrize("name", ["shirt", "blended"])
def test_a_close_fitting_garment_follows_the_shape_of_the_body(page, name):
    found, skin, _ = page.frames(list(made()).index(name), 20, betas=BETAS)
    frames = played(made()[name], body().body.shaped(BETAS), walk(), 20)
    assert farthest_mm(found, frames) < WITHIN_MM
    # the shapes of the file are in steps of some micrometres
    assert max(np.abs(one - other.body.vertices).max() for one, other in zip(skin, frames, strict=True)) < 2e-5


def test_a_slider_gives_what_a_start_on_that_shape_gives(page):
    page.frames(list(made()).index("shirt"), 1, clip=0)
    script = """
        const [betas] = arguments, index = hemline.players.indexOf(hemline.player);
        const still = () => [1, 2, 3].forEach(() => hemline.player.step(hemline.state, hemline.clip.at(0.5), 1 / 30));
        const seen = () => (still(), Array.from(hemline.player.vertices));
        hemline.seek(0.5);
        hemline.reshape(betas);
        const one = seen();
        hemline.choose(index, 0, betas);
        hemline.seek(0.5);
        const other = seen();
        return Math.max(...one.map((value, i) => Math.abs(value - other[i])));
    """
    assert page.driver.execute_script(script, list(BETAS)) < 1e-3


def test_two_calls_within_a_tenth_of_a_millisecond_do_not_throw_the_cloth(page):
    """The largest move of a vertex in the frames after, relative to the body, is about that of frames of usual length.

    As in `tests/playback/test_playback_pause.py`, since the body is a whole frame farther on.
    """
    page.frames(list(made()).index("ropes"), 1, clip=0)
    script = """
        const { player, clip } = hemline, pose = (index) => clip.at(index / 30), quiet = { pushing: false };
        let walking = hemline.state;
        for (let index = 1; index < 12; index++) walking = player.step(walking, pose(index), 1 / 30, quiet);
        const largest = (dt) => {
            let state = player.step(walking, pose(12), dt, quiet), most = 0;
            for (let index = 13; index < 20; index++) {
                const seen = player.vertices.slice();
                state = player.step(state, pose(index), 1 / 30, quiet);
                const place = (index) => pose(index).translation, [from, to] = [place(index - 1), place(index)];
                seen.forEach((value, n) => {
                    const moved = player.vertices[n] - value - (to[n % 3] - from[n % 3]);
                    most = Math.max(most, Math.abs(moved));
                });
            }
            return most;
        };
        return [largest(1 / 30), largest(1e-4)];
    """
    usual, after_a_moment = page.driver.execute_script(script)
    assert 0 < after_a_moment < 1.5 * usual + 0.02


def test_normals_are_those_of_the_mesh(page):
    page.frames(0, 3)
    found = page.driver.execute_script("hemline.player.shade(); return Array.from(hemline.player.normals)")
    vertices = page.frames(0, 3, pushing=True)[0][-1]
    normals = page.driver.execute_script("hemline.player.shade(); return Array.from(hemline.player.normals)")
    assert not np.array_equal(found, normals)
    expected = vertex_normals(vertices, ropes_model().garment.faces)
    assert np.abs(np.reshape(normals, (-1, 3)) - expected).max() < 1e-4


def test_ropes_keep_to_the_shape_that_the_page_was_made_for(page):
    found, skin, _ = page.frames(0, 5, betas=BETAS)
    plain, plain_skin, _ = page.frames(0, 5)
    assert np.array_equal(found, plain) and np.array_equal(skin, plain_skin)


@pytest.mark.parametrize("pushing", [False, True])
def test_the_same_frames_again_to_the_bit(page, pushing):
    names = list(made())
    first = page.frames(names.index("windy"), 25, pushing=pushing)[0]
    page.frames(names.index("shirt"), 3, betas=BETAS, pushing=True)
    assert np.array_equal(first, page.frames(names.index("windy"), 25, pushing=pushing)[0])


def shorten_edges(garment, vertices, rest, stretch=1.15, sweeps=4):
    """Shortens edges that are too long by pattern and rest, in sweeps to and fro, in plain NumPy."""
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)

    def along(places):
        return np.linalg.norm(places[edges[:, 1]] - places[edges[:, 0]], axis=1)

    listed, moved = np.flatnonzero(along(vertices) > stretch * lengths), vertices.astype(np.float64)
    longest = stretch * np.maximum(lengths, along(rest.astype(np.float64)))
    for sweep in range(sweeps):
        for e in listed if sweep % 2 == 0 else listed[::-1]:
            a, b = edges[e]
            way = moved[b] - moved[a]
            length = np.linalg.norm(way)
            step = 0.5 * max(0.0, length - longest[e]) * way / length
            moved[a] += step
            moved[b] -= step
    return moved


def test_edges_that_are_too_long_are_shortened_as_in_python(page):
    """Of the shirt, with every vertex moved by chance: a fifth of its edges is too long."""
    model, random = made()["shirt"], np.random.default_rng(3)
    rest = model.at_rest(model.start(body().posed(body().rest_pose)), body())
    torn = (rest + random.normal(scale=0.003, size=rest.shape)).astype(np.float32)
    expected = shorten_edges(model.garment, torn, rest)
    page.frames(list(made()).index("shirt"), 1)
    script = """
        const [torn, rest] = Array.from(arguments, (each) => Float32Array.from(each));
        hemline.player.animator.limits.limit(torn, rest);
        return Array.from(torn);
    """
    found = page.driver.execute_script(script, torn.ravel().tolist(), rest.ravel().tolist())
    assert np.abs(expected - torn).max() > 1e-3
    assert np.abs(np.reshape(found, (-1, 3)) - expected).max() < 1e-6


def test_a_page_for_another_shape_and_a_body_whose_skin_the_pose_bends(tmp_path):
    random, plain = np.random.default_rng(4), body().body
    posedirs = (0.002 * random.normal(size=(207, len(plain.template), 1))).astype(np.float16).astype(np.float32)
    bent = replace(plain, posedirs=np.broadcast_to(posedirs, (207, len(plain.template), 3)))
    model, shaped = replace(ropes_model(), body_hash=bent.hash), bent.shaped(BETAS)
    web.write_page(tmp_path / "page.html", web.page_contents({"cape": model}, {"walk": walk()}, shaped), title="bent")
    with opened((tmp_path / "page.html").as_uri()) as page:
        found, skin, _ = page.frames(0, 15)
    frames = played(model, shaped, walk(), 15)
    assert farthest_mm(found, frames) < WITHIN_MM
    assert max(np.abs(one - other.body.vertices).max() for one, other in zip(skin, frames, strict=True)) < 1e-5


def test_a_shipped_model_plays_as_in_python_and_the_push_leads_most_of_it_out(tmp_path):
    clip, shirt = hemline.motions.load("walk")[:30], hemline.load("tshirt-light")
    web.write_page(tmp_path / "page.html", web.page_contents({"shirt": shirt}, {"clip": clip}, body()), title="shirt")
    with opened((tmp_path / "page.html").as_uri()) as page:
        found, skin, _ = page.frames(0, len(clip))
        pushed, _, _ = page.frames(0, len(clip), pushing=True)
        page.driver.execute_script("Object.getPrototypeOf(hemline.player.animator.limits).limit = () => {}")
        unlimited, _, _ = page.frames(0, len(clip), pushing=True)
    assert farthest_mm(found, played(shirt, body(), clip, len(clip))) < WITHIN_MM
    *_, last = play(shirt, body(), clip)
    free = np.ones(len(last.vertices), bool)
    free[last.report.pinched] = False  # between arm and chest there is no place outside
    before, after = ((inside(skin[-1], body().body.faces, each[-1]) & free).sum() for each in (found, pushed))
    assert before > 30 and after < before / 1.5
    assert np.linalg.norm(pushed - found, axis=2).max() < 0.07
    edges, lengths = rest_lengths(shirt.garment.faces, shirt.garment.rest_edges)
    long = [
        (np.linalg.norm(each[:, edges[:, 0]] - each[:, edges[:, 1]], axis=2) > 1.25 * lengths).mean()
        for each in (pushed, unlimited)
    ]
    assert long[0] < 0.8 * long[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cape", "skirt", "knee-dress", "robe", "longsleeve-light", "trousers-light"])
def test_shipped_models_play_three_hundred_frames_as_in_python(tmp_path, name):
    dance = hemline.motions.load("dance")
    there_and_back = {
        each: np.concatenate([getattr(dance, each), getattr(dance, each)[-2:0:-1]])[:300]
        for each in ("rotations", "translations")
    }
    check_shipped(tmp_path, name, replace(dance, **there_and_back))


def check_shipped(folder, name, clip):
    model, shaped = hemline.load(name), body()
    web.write_page(folder / "page.html", web.page_contents({name: model}, {"clip": clip}, shaped), title=name)
    with opened((folder / "page.html").as_uri()) as page:
        found, _, _ = page.frames(0, len(clip))
    assert len(found) == len(clip)
    assert farthest_mm(found, played(model, shaped, clip, len(clip))) < 1.0
