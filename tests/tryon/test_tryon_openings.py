"""Openings that no limb goes through: cut-outs are worn with a warning, what is worn wrongly is refused."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import garments
from hemline.garments.pin_rules import NO_PINS
from hemline.motions.motion import JOINT_NAMES
from hemline.tryon import fitness
from hemline.tryon.openings import empty_openings, openings_are_harmless


def without(garment, gone):
    """The garment without the triangles whose centres are `gone`, its loose vertices left out; no pins."""
    faces = garment.faces[~gone(garment.vertices[garment.faces].mean(axis=1).T)]
    kept, faces = np.unique(faces, return_inverse=True)
    rest_edges = garment.rest_edges[~gone(garment.vertices[garment.faces].mean(axis=1).T)]
    faces = faces.reshape(-1, 3).astype(np.int32)
    return replace(garment, vertices=garment.vertices[kept], faces=faces, rest_edges=rest_edges)


@pytest.fixture(scope="module")
def dress():
    return garments.load("dress-light")


@pytest.fixture(scope="module")
def keyhole(dress):
    """The sleeveless dress with a hole of 12 cm between the shoulder blades."""
    return without(dress, lambda c: (np.hypot(c[0], c[1] - 0.33) < 0.06) & (c[2] < 0))


def moved(shaped, moves):
    """A body whose joints were moved; only lines from joint to joint are asked for here."""
    joints = shaped.joints.copy()
    for name, place in moves.items():
        joints[JOINT_NAMES.index(name)] = place
    return replace(shaped, joints=joints)


def arm_inside(shaped, side, *, long):
    """A body with one arm in front of its trunk; a long one comes out at the hem."""
    x, down = (0.05 if side == "left" else -0.05), (-0.5 if long else -0.05)
    places = {"shoulder": 0.4, "elbow": 0.2, "wrist": down, "hand": down - 0.1}
    return moved(shaped, {f"{side}_{name}": (x, y, 0.05) for name, y in places.items()})


def test_a_keyhole_is_worn_with_a_warning(shaped, dress, keyhole):
    assert empty_openings(dress.vertices, dress.faces, shaped) == () and openings_are_harmless(
        dress.vertices, dress.faces, shaped
    )
    assert empty_openings(keyhole.vertices, keyhole.faces, shaped) == ("spine3",)
    found = fitness(keyhole, shaped)
    assert found.reason is None
    assert found.warnings == ("no limb goes through 1 of its openings, near the spine3",)
    assert found.figures["inside"] == 0 and found.figures["self_crossing_percent"] < 0.5


def test_a_sleeveless_dress_below_the_shoulders_has_two_empty_armholes(shaped, dress):
    """As a dress without straps is worn: trunk through the neckline, arms above it."""
    low = dress.vertices - np.float32([0, 0.25, 0])
    assert len(empty_openings(low, dress.faces, shaped)) == 2 and openings_are_harmless(low, dress.faces, shaped)


REFUSED = {
    "an arm inside a dress with a keyhole": ("keyhole", 0.0, lambda body: arm_inside(body, "left", long=False)),
    "an arm that comes out at the hem": ("keyhole", 0.0, lambda body: arm_inside(body, "right", long=True)),
    "an arm inside a dress": ("dress", 0.0, lambda body: arm_inside(body, "right", long=False)),
    "an arm inside a shirt": ("tshirt", 0.0, lambda body: arm_inside(body, "left", long=False)),
    "a shirt worn as a skirt": ("tshirt", -0.6, lambda body: body),
    "a shirt below the shoulders, its sleeves empty": ("tshirt", -0.25, lambda body: body),
    "a shirt beside the body": ("tshirt", 2.0, lambda body: body),
    "a dress around the hips": ("dress", -0.6, lambda body: body),
    "shorts with both legs in one": (
        "shorts",
        0.0,
        lambda body: moved(
            body,
            {
                f"left_{name}": body.joints[JOINT_NAMES.index(f"right_{name}")]
                for name in ("hip", "knee", "ankle", "foot")
            },
        ),
    ),
}
"""Garments that must be refused: what, how far it is lifted [m], and the body."""


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_worn_wrongly_is_refused(name, shaped, worn, dress, keyhole):
    which, lift, body = REFUSED[name]
    shorts = replace(worn["trousers"], pins=NO_PINS)
    shorts = without(shorts, lambda c: c[1] < -0.3)
    garment = {"dress": dress, "keyhole": keyhole, "shorts": shorts, **worn}[which]
    vertices = garment.vertices + np.float32([0, lift, 0])
    wearing = body(shaped)
    assert empty_openings(vertices, garment.faces, wearing) and not openings_are_harmless(
        vertices, garment.faces, wearing
    )


def test_a_small_suit_between_the_feet_is_refused(shaped, worn):
    """A dress for a doll: all its openings are nearest to the feet, and none has a limb."""
    shirt = worn["tshirt"]
    middle = shirt.vertices.mean(axis=0)
    between_feet = shaped.joints[[JOINT_NAMES.index("left_foot"), JOINT_NAMES.index("right_foot")]].mean(axis=0)
    small = (0.3 * (shirt.vertices - middle) + between_feet).astype(np.float32)
    assert empty_openings(small, shirt.faces, shaped) == ()
    doll = replace(shirt, vertices=small, rest_edges=0.3 * shirt.rest_edges, pins=NO_PINS)
    assert fitness(doll, shaped).reason == "nothing goes through any of its openings: it lies beside the body"
    assert fitness(worn["trousers"], shaped).reason is None
