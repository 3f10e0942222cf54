"""Plays SCENE (npz, see `scene.py`) by vertex block descent on the CPU in Newton's Python, and writes OUT (npz).

The material is that of hemline for small strain: equal Lame constants on equal rest triangles (stable neo-Hookean
instead of St. Venant-Kirchhoff), equal bending stiffness of each edge, equal lumped masses.
"""

# newton and warp are installed in a separate environment
# pyright: reportMissingImports=false

import json
import sys
import time

import newton
import numpy as np
import warp as wp


def main(scene_path: str, out: str, options: str) -> None:
    wp.config.quiet = True
    settings = json.loads(options)
    with np.load(scene_path) as arrays:
        scene = dict(arrays)
    with wp.ScopedDevice("cpu"):
        frames, ms = NewtonRun(scene, settings).frames()
    np.savez(out, frames=frames, ms=np.array(ms), ms_without=np.zeros(len(ms)))


class NewtonRun:
    """Scene that Newton plays."""

    def __init__(self, scene: dict, settings: dict):
        self.scene, self.settings = scene, settings
        self.model = build_model(scene)
        self.solver = newton.solvers.SolverVBD(
            self.model,
            iterations=settings["iterations"],
            friction_epsilon=float(scene["creep"]),
            particle_enable_self_contact=settings["self_thickness"] > 0,
            particle_self_contact_margin=max(settings["self_thickness"], 1e-4),
            particle_self_contact_gap=max(settings["self_thickness"], 1e-4),
            particle_enable_tile_solve=False,
        )
        self.now, self.next = self.model.state(), self.model.state()
        self.control = self.model.control()
        self.has_body = bool(len(scene["body_faces"]))
        self.pipeline = newton.CollisionPipeline(self.model, soft_contact_gap=0.02) if self.has_body else None
        self.contacts = self.pipeline.contacts() if self.pipeline else None
        self.pins = scene["pins"]

    def frames(self) -> tuple[np.ndarray, list[float]]:
        """Returns the positions and the time [ms] of each frame."""
        positions, ms = [self.scene["vertices"].astype(np.float32)], [0.0]
        for frame in range(1, len(self.scene["pinned"])):
            began = time.perf_counter()
            for step in range(self.settings["substeps"]):
                self.step(frame - 1, step)
            if self.settings["kept_speed"] < 1:
                self.now.particle_qd.assign(self.settings["kept_speed"] * self.now.particle_qd.numpy())
            positions.append(self.now.particle_q.numpy().copy())
            ms.append(1000 * (time.perf_counter() - began))
        return np.array(positions), ms

    def step(self, frame: int, step: int) -> None:
        """Advances one step of a frame; body and pins are interpolated linearly."""
        count = self.settings["substeps"]
        h = 1 / float(self.scene["fps"]) / count

        def between(frames: np.ndarray, fraction: float) -> np.ndarray:
            return ((1 - fraction) * frames[frame] + fraction * frames[frame + 1]).astype(np.float32)

        if self.has_body:
            body = self.scene["body"]
            mesh = self.model.shape_source[0].mesh
            mesh.points.assign(between(body, (step + 1) / count))
            mesh.velocities.assign(((body[frame + 1] - body[frame]) * float(self.scene["fps"])).astype(np.float32))
            mesh.refit()
        if len(self.pins):
            positions = self.now.particle_q.numpy()
            positions[self.pins] = between(self.scene["pinned"], (step + 1) / count)
            self.now.particle_q.assign(positions)
        self.now.clear_forces()
        if self.pipeline:
            self.pipeline.collide(self.now, self.contacts)
        self.solver.step(self.now, self.next, self.control, self.contacts, h)
        self.now, self.next = self.next, self.now


def build_model(scene: dict):
    """Builds the model with the rest metric, bending and masses of hemline."""
    builder = newton.ModelBuilder(up_axis=newton.Axis.Y)
    young, poisson = float(scene["young"]), float(scene["poisson"])
    shear = young / (2 * (1 + poisson))
    builder.add_cloth_mesh(
        pos=wp.vec3(0.0),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0),
        vertices=scene["vertices"].tolist(),
        indices=scene["faces"].ravel().tolist(),
        density=1.0,
        tri_ke=shear,
        tri_ka=young * poisson / (1 - poisson**2),
        tri_kd=0.5 * float(scene["damping"]) * shear,
        edge_ke=0.0,
        edge_kd=0.0,
        particle_radius=float(scene["thickness"]),
    )
    builder.particle_mass = scene["mass"].tolist()
    if len(scene["body_faces"]):
        mesh = newton.Mesh(scene["body"][0].astype(np.float32), scene["body_faces"].ravel(), compute_inertia=False)
        contact = newton.ModelBuilder.ShapeConfig(margin=0.0)
        builder.add_shape_mesh(body=-1, mesh=mesh, cfg=contact)
    builder.color(include_bending=True)
    model = builder.finalize()
    model.set_gravity(tuple(scene["gravity"]))
    pin_particles(model, scene["pins"])
    set_rest_shape(model, scene)
    if len(scene["body_faces"]):
        model.soft_contact_ke, model.soft_contact_kd = float(scene["push"]), 0.0
        model.soft_contact_mu = float(scene["friction"])
        for name, value in (("ke", float(scene["push"])), ("kd", 0.0), ("mu", float(scene["friction"]))):
            getattr(model, f"shape_material_{name}").fill_(value)
        # bounds of all frames, as the body moves and Newton takes those of the first one
        model.shape_collision_aabb_lower.assign(scene["body"].min(axis=(0, 1))[None].astype(np.float32) - 1)
        model.shape_collision_aabb_upper.assign(scene["body"].max(axis=(0, 1))[None].astype(np.float32) + 1)
    return model


def pin_particles(model, pins: np.ndarray) -> None:
    """Fixes particles by removing their mass and their freedom."""
    flags, mass = model.particle_flags.numpy(), model.particle_mass.numpy()
    flags[pins] &= ~int(newton.ParticleFlags.ACTIVE)
    mass[pins] = 0
    model.particle_flags.assign(flags)
    model.particle_mass.assign(mass)
    model.particle_inv_mass.assign(np.where(mass > 0, 1 / np.where(mass > 0, mass, 1), 0).astype(np.float32))


def set_rest_shape(model, scene: dict) -> None:
    """Sets the rest triangles and bending of hemline instead of those of the start positions."""
    rest = scene["rest_edges"]
    model.tri_poses.assign(np.linalg.inv(rest).astype(np.float32))
    model.tri_areas.assign((0.5 * np.abs(np.linalg.det(rest))).astype(np.float32))
    place = {tuple(sorted(pair)): number for number, pair in enumerate(scene["hinges"][:, :2].tolist())}
    edges = model.edge_indices.numpy()
    stiffness, angle = np.zeros(len(edges), np.float32), np.zeros(len(edges), np.float32)
    for edge, (first, second, start, end) in enumerate(edges.tolist()):
        hinge = place.get((min(start, end), max(start, end)))
        if hinge is None or first < 0 or second < 0:
            continue
        stiffness[edge] = scene["hinge_weight"][hinge]
        if len(scene["hinge_rest"]):
            # the sign of an angle: which of the two vertices comes first, and the direction of the edge
            same = (scene["hinges"][hinge, 2] == first) == (scene["hinges"][hinge, 0] == start)
            angle[edge] = scene["hinge_rest"][hinge] * (1 if same else -1)
    lengths = np.ones(len(edges), np.float32)
    model.edge_rest_length.assign(lengths)
    model.edge_rest_angle.assign(angle)
    properties = model.edge_bending_properties.numpy()
    properties[:, 0] = stiffness
    model.edge_bending_properties.assign(properties)


main(*sys.argv[1:])
