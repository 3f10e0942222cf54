"""What a notebook shows of a garment and of a player: a picture, and a line of facts."""

import base64
import html
import io
import re
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import hemline
from hemline import garments
from hemline.garments.thumbnail import LONGEST, png_bytes, thumbnail
from hemline.playback import Player


def shown(thing) -> tuple[np.ndarray, str]:
    """The picture (height, width, 3) and the caption that a notebook gets."""
    found = re.fullmatch(
        r"<figure><img alt='[^']*' src='data:image/png;base64,([^']+)'><figcaption>(.*)</figcaption></figure>",
        thing._repr_html_(),
    )
    assert found
    with Image.open(io.BytesIO(base64.b64decode(found[1]))) as picture:
        return np.asarray(picture.convert("RGB")), html.unescape(found[2])


def red_share(picture: np.ndarray) -> float:
    red, green, blue = picture.reshape(-1, 3).astype(int).T
    return float(((red > 1.8 * green) & (red > 1.8 * blue)).mean())


@pytest.mark.parametrize("name", ["cape", "tshirt-light"])
def test_a_garment_is_a_picture_with_its_facts(name):
    garment = garments.load(name)
    picture, said = shown(garment)
    assert 0.3 < red_share(picture) < 0.9 and len(np.unique(picture.reshape(-1, 3), axis=0)) > 20
    assert max(picture.shape[:2]) - LONGEST in range(20)
    width, height, _ = np.ptp(garment.vertices, axis=0)
    assert picture.shape[1] / picture.shape[0] == pytest.approx(width / height, rel=0.05)
    assert said.startswith(f"{name}: {len(garment.vertices)} vertices, {len(garment.faces)} triangles")
    assert garment.material.name in said and f"{width:.2f} x {height:.2f} x " in said and said.endswith(" m")


def test_the_left_of_a_garment_is_at_the_right_of_its_picture_and_what_is_in_front_hides_the_rest():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    small = 0.5 * square + np.array([0.5, 0.5, 0.2], np.float32)
    back, front = [[0, 2, 1], [0, 3, 2]], [[4, 5, 6], [4, 6, 7]]  # what is seen from behind is darker
    picture = thumbnail(np.concatenate([square, small]), np.array([*back, *front], np.int32))
    height, width, _ = picture.shape
    left, right = picture[height // 4, width // 4], picture[height // 4, 3 * width // 4]
    assert right[0] > 1.2 * left[0] > 40
    assert (picture[height // 2 :, width // 4 : -20].std(axis=(0, 1)) > 1).any() and (picture[0] == 255).all()


def test_thumbnails_are_png_files_of_the_same_pixels():
    picture = np.random.default_rng(0).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    with Image.open(io.BytesIO(png_bytes(picture))) as read:
        np.testing.assert_array_equal(np.asarray(read), picture)


def test_a_name_is_text_and_no_html():
    garment = garments.load("tshirt-light")
    object.__setattr__(garment, "name", "<b>'&")
    assert shown(garment)[1].startswith("<b>'&: ")


def test_a_player_is_a_picture_of_the_worn_garment():
    player = Player.prepare(hemline.load("tshirt-light"), hemline.bodies.load("anny24").shaped((1.0,)))
    picture, said = shown(player)
    assert picture.shape == (400, 300, 3) and 0.03 < red_share(picture) < 0.4
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500, "body, cloth, ground and shadows"
    assert said.startswith(player.garment.facts) and said.endswith("played by agentdress on anny24")


def test_a_garment_is_shown_without_loading_a_renderer():
    code = (
        "import sys; from hemline import garments; garments.load('tshirt-light')._repr_html_();"
        "print([name for name in ('PIL', 'hemline.pictures') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
