"""Bodies that cut themselves, and garments that cut bodies: what the projection is tried on."""

from types import SimpleNamespace

import numpy as np
import trimesh

from hemline import bodies, motions


def spheres(*centres, radius=0.1, subdivisions=3):
    """Spheres as one mesh: vertices float32, faces int32."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    vertices = np.concatenate([ball.vertices + centre for centre in centres]).astype(np.float32)
    faces = np.concatenate([ball.faces + k * len(ball.vertices) for k in range(len(centres))]).astype(np.int32)
    return vertices, faces


def two_balls(distance):
    """A body of two parts and two bones that is no person: balls of 10 cm, at rest 1 m apart, posed at `distance`."""
    rest, faces = spheres((0, 0, 0), (1, 0, 0))
    half = len(rest) // 2
    indices = np.zeros((len(rest), 6), np.int32)
    indices[half:, 0] = 1
    weights = np.zeros((len(rest), 6), np.float32)
    weights[:, 0] = 1
    body = SimpleNamespace(faces=faces, weight_indices=indices, weights=weights, parents=np.array([-1, 0, 0, 0]))
    shaped = SimpleNamespace(body=body, vertices=rest)
    transforms = np.tile(np.eye(3, 4, dtype=np.float32), (4, 1, 1))
    transforms[1, 0, 3] = distance - 1
    moved = rest + transforms[indices[:, 0], :, 3]
    return shaped, SimpleNamespace(shaped=shaped, transforms=transforms, vertices=moved, faces=faces)


def clip(name, betas=(), frames=24, step=1, first=0):
    """A shaped body, and some of its poses in a shipped excerpt."""
    shaped = bodies.load("anny24").shaped(betas)
    motion = shaped.placed(motions.load(name))[first : first + frames * step : step]
    return shaped, [shaped.posed(motion[i]) for i in range(len(motion))], motion.fps


class Skintight:
    """Cloth that rides on the skin at a height that swings smoothly in space and time, partly below it."""

    def __init__(self, shaped, count, seed=0, layers=(0.0,)):
        random = np.random.default_rng(seed)
        corners = shaped.vertices[shaped.body.faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        picked = random.choice(len(corners), count, p=area / area.sum())
        self.corners, self.weights = shaped.body.faces[picked], random.dirichlet([1, 1, 1], count)
        self.layers, self.seed = layers, seed
        self.rest = np.concatenate([self._at(shaped.vertices, shaped.normals, 0 * area[:1] + each) for each in layers])

    def normals(self, vertices_normals):
        """Normals of the skin under each place of a layer."""
        normal = np.einsum("nc,nck->nk", self.weights, vertices_normals[self.corners].astype(float))
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def _at(self, vertices, normals, height):
        place = np.einsum("nc,nck->nk", self.weights, vertices[self.corners].astype(float))
        return (place + self.normals(normals) * height[:, None]).astype(np.float32)

    def over(self, posed, seconds, mean=0.003, swing=0.005):
        """The cloth over one pose [m]."""
        random = np.random.default_rng(self.seed + 1)
        waves = random.normal(size=(3, 16)) * 2 * np.pi / 0.3
        phase = self.rest[: len(self.corners)] @ waves + 2 * np.pi * random.uniform(0.3, 1.5, 16) * seconds
        height = mean + swing * np.sin(phase).sum(axis=1) / np.sqrt(8)
        return np.concatenate([self._at(posed.vertices, posed.normals, height + each) for each in self.layers])


def sheet_behind(shaped, rows=60, columns=60, swing=0.02):
    """A loose sheet behind the back, and the function that carries it with the chest, swinging into the body [m]."""
    across, down = np.meshgrid(np.linspace(-0.3, 0.3, columns), np.linspace(0, 0.8, rows))
    chest = shaped.joints[9]
    rest = np.stack([chest[0] + across, chest[1] + 0.1 - down, chest[2] - 0.12 - 0.05 * down], axis=-1)
    rest = rest.reshape(-1, 3).astype(np.float32)

    def carried(posed, seconds):
        sway = swing * np.sin(2 * np.pi * 0.8 * seconds + 4 * across.reshape(-1) + 5 * down.reshape(-1))
        turn, shift = posed.transforms[9, :, :3], posed.transforms[9, :, 3]
        return ((rest + sway[:, None] * [0, 0, 1]) @ turn.T + shift).astype(np.float32)

    return rest, carried


def inside_count(posed, vertices, but):
    """How many vertices libigl's solid angles find inside the posed body, apart from those in `but`."""
    import igl

    kept = np.setdiff1d(np.arange(len(vertices)), but)
    winding = igl.winding_number(
        posed.vertices.astype(float), np.ascontiguousarray(posed.faces), vertices[kept].astype(float)
    )
    return int(np.count_nonzero(np.abs(winding) > 0.5))
