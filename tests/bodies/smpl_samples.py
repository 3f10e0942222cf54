"""Made-up models with the keys, shapes and pickled classes of SMPL, SMPL-H and SMPL-X files, and SMPL's own formula."""

import pickle
import sys
from collections import OrderedDict
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
from scipy.sparse import csc_matrix
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from hemline import bodies
from hemline.bodies.velocities import reshaping_velocity
from tests.bodies.body_samples import t_pose

BODY = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
LEFT = [20, 22, 23, 20, 25, 26, 20, 28, 29, 20, 31, 32, 20, 34, 35]
RIGHT = [21, 37, 38, 21, 40, 41, 21, 43, 44, 21, 46, 47, 21, 49, 50]
PARENTS = {24: [*BODY, 20, 21], 52: [*BODY, *LEFT, *RIGHT]}
PARENTS[55] = [*BODY, 15, 15, 15, *(p + 3 if p > 21 else p for p in (*LEFT, *RIGHT))]
"""Parents as the files have them, by number of joints."""


def small_arrays(joints: int = 24, *, betas: int = 10, verts: int = 90, seed: int = 0) -> dict[str, np.ndarray]:
    """A cloud of points with everything random: each vertex is moved by up to four joints."""
    random = np.random.default_rng(seed)
    weights = np.zeros((verts, joints))
    for row in weights:
        row[random.choice(joints, 4, replace=False)] = random.dirichlet(np.ones(4))
    regressor = random.random((joints, verts)) * (random.random((joints, verts)) < 0.2)
    return {
        "v_template": random.normal(scale=0.5, size=(verts, 3)),
        "shapedirs": random.normal(scale=0.02, size=(verts, 3, betas)),
        "posedirs": random.normal(scale=0.005, size=(verts, 3, 9 * (joints - 1))),
        "weights": weights,
        "J_regressor": regressor / regressor.sum(axis=1, keepdims=True),
        "kintree_table": np.array([[2**32 - 1, *PARENTS[joints][1:]], range(joints)], np.uint32),
        "f": random.permuted(np.tile(np.arange(verts, dtype=np.uint32), (60, 1)), axis=1)[:, :3],
    }


@cache
def _anny_arrays() -> dict[str, np.ndarray]:
    shaped = bodies.load().shaped()
    body, posed, random = shaped.body, shaped.posed(t_pose()), np.random.default_rng(0)
    template, off = posed.vertices.astype(np.float64), np.array([0.01, -0.2, 0.02])
    weights, regressor = np.zeros((len(template), 24)), np.zeros((24, len(template)))
    np.add.at(weights, (np.arange(len(template))[:, None], body.weight_indices), body.weights.astype(np.float64))
    near = KDTree(template).query(posed.joints, 100)[1]
    for row, joint, ids in zip(regressor, posed.joints, near, strict=True):
        row[ids] = np.linalg.pinv(np.vstack([template[ids].T, np.ones(100)])) @ [*joint, 1]
    held = weights[:, None, 1:, None] * posed.normals[:, :, None, None]
    return {
        "v_template": template + off,
        "shapedirs": np.stack([reshaping_velocity(posed, beta) for beta in range(10)], axis=2),
        "posedirs": (held * random.normal(scale=0.004, size=9)).reshape(len(template), 3, -1),
        "weights": weights,
        "J_regressor": regressor,
        "kintree_table": np.array([[2**32 - 1, *PARENTS[24][1:]], range(24)], np.uint32),
        "f": body.faces.astype(np.uint32),
    }


def anny_arrays() -> dict[str, np.ndarray]:
    """The body that ships as an SMPL model: in the T-pose, off the origin, with made-up pose offsets."""
    return dict(_anny_arrays())


def smpl_vertices(arrays: dict, betas: np.ndarray, turns: np.ndarray, trans: np.ndarray) -> np.ndarray:
    """Vertices by SMPL's formula as published (Loper et al. 2015, Eq. 2 to 9): (verts, 3) [m]."""
    shaped = arrays["v_template"] + arrays["shapedirs"][:, :, : len(betas)] @ betas
    joints, matrices = arrays["J_regressor"] @ shaped, Rotation.from_rotvec(turns).as_matrix()
    offset = shaped + arrays["posedirs"] @ (matrices[1:] - np.eye(3)).ravel()
    chain = np.zeros((len(joints), 4, 4))
    for joint, parent in enumerate(PARENTS[len(joints)]):
        local = np.eye(4)
        local[:3, :3] = matrices[joint]
        local[:3, 3] = joints[joint] - (joints[parent] if parent >= 0 else 0)
        chain[joint] = chain[parent] @ local if parent >= 0 else local
    chain[:, :3, 3] -= np.einsum("jrc,jc->jr", chain[:, :3, :3], joints)
    blended = np.einsum("vj,jrc->vrc", arrays["weights"], chain)
    return np.einsum("vrc,vc->vr", blended[:, :3, :3], offset) + blended[:, :3, 3] + trans


class Ch:
    """Pickles as chumpy's variable does."""

    def __init__(self, x: np.ndarray):
        self.x, self._dirty_vars, self._itr, self._depends_on_deps = x, {"x"}, None, OrderedDict(x=1)


class Select:
    """Pickles as chumpy's selection does: entries `idxs` of `a` in a shape."""

    def __init__(self, a: object, idxs: np.ndarray, preferred_shape: object):
        self.a, self.idxs, self.preferred_shape, self._dirty_vars = a, idxs, preferred_shape, set()


@contextmanager
def chumpy_in_sight():
    """The two classes can be imported where chumpy has them; nothing of it is left afterwards."""
    places = {Ch: "chumpy.ch", Select: "chumpy.reordering"}
    before = {kind: kind.__module__ for kind in places}
    try:
        sys.modules["chumpy"] = ModuleType("chumpy")
        for kind, name in places.items():
            sys.modules[name] = ModuleType(name)
            setattr(sys.modules[name], kind.__name__, kind)
            kind.__module__ = name
        yield
    finally:
        for name in ("chumpy", *places.values()):
            sys.modules.pop(name, None)
        for kind, name in before.items():
            kind.__module__ = name


class Python2Pickler(pickle._Pickler):
    """Writes text and bytes as Python 2 does: strings of 8-bit characters."""

    dispatch = dict(pickle._Pickler.dispatch)  # noqa: RUF012

    def save_string(self, text: str | bytes) -> None:
        content = text.encode("latin1") if isinstance(text, str) else text
        self.write(pickle.BINSTRING + len(content).to_bytes(4, "little") + content)
        self.memoize(text)

    dispatch[bytes] = dispatch[str] = save_string


def as_published(arrays: dict) -> dict:
    """The content of an SMPL `.pkl`: chumpy variables, a sparse regressor, and what is not read."""
    content = dict(arrays)
    wide = np.concatenate([arrays["shapedirs"], np.ones_like(arrays["shapedirs"][:, :, :3])], axis=2)
    ids = np.arange(wide.size).reshape(wide.shape)[:, :, :-3]
    content["shapedirs"] = Select(Ch(wide), ids.ravel(), ids.shape)
    content["posedirs"], content["v_template"] = Ch(arrays["posedirs"]), Ch(arrays["v_template"])
    content["J_regressor"] = csc_matrix(arrays["J_regressor"])
    content["weights"] = np.asfortranarray(arrays["weights"])
    return content | {"bs_style": "lbs", "bs_type": "lrotmin", "part2num": np.array([{"a": 1}, None], object)}


def write_published(path: Path, arrays: dict) -> Path:
    """Write a `.pkl` as Python 2, numpy 1 and chumpy do."""
    with path.open("wb") as stream, chumpy_in_sight():
        Python2Pickler(stream, 2).dump(as_published(arrays))
    old = path.read_bytes().replace(b"numpy._core.", b"numpy.core.").replace(b"scipy.sparse._csc", b"scipy.sparse.csc")
    path.write_bytes(old)
    return path


def write_pickle(path: Path, content: object, protocol: int = 2) -> Path:
    """Write a `.pkl` as today's Python does."""
    with chumpy_in_sight():
        path.write_bytes(pickle.dumps(content, protocol))
    return path
