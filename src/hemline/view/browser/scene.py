"""The meshes of the page: body, garment, the simulated garment beside it, and marks.

All of them hang on one node, which is moved so that the camera follows the body.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.animators.ropes import AnimatorRopes
from hemline.arrays import Vertices
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.pictures import BODY, CLOTH, TRUTH, clearest_view, view_axes
from hemline.view.stage.measures import STAGES, cloth_of, errors, inside_body, stretches
from hemline.view.stage.source import PlayedClip
from hemline.view.stage.stage import Stage

from .bands import COLOURS, ERROR, STRETCH, Scale, split
from .colliders import cone_surfaces

PLAIN, BODIES = "one colour", ("solid", "see-through", "hidden")
PAINTS: dict[str, Scale | None] = {PLAIN: None, "stretch": STRETCH, "error to the simulation": ERROR}
"""Ways to colour the garment, by their names on the page."""
BESIDE = np.array([-1.2, 0.0, 0.0])
"""Displacement of the simulated garment from the animated one [m]."""
SEE_THROUGH = 0.35
"""Opacity of see-through meshes."""
RED, BONE, CONE = (255, 0, 0), (30, 30, 40), (0.95, 0.7, 0.25)
POINT, LINE = 0.012, 3.0
"""Size of the red marks [m], width of the bones [pixels]."""
AWAY, ASIDE = 3.9, 0.4
"""Distance of the camera, and offset to the right of the body at which it looks [m]."""
FLOOR, TILES = (205, 205, 205), 10
"""Colour of the floor, and the number of its tiles of one metre on each side of the middle."""
HANDLE = 0.35
"""Size of the handle at the pelvis [m]."""


@dataclass(frozen=True)
class Look:
    """How a frame is shown; the fields are named as the requests that change them."""

    shown: str = STAGES[0]
    paint: str = PLAIN
    mark: bool = False
    """Whether vertices inside the body are red."""
    body: str = BODIES[0]
    follow: bool = True
    """Whether the camera goes with the body."""
    bones: bool = False
    colliders: bool = False
    handle: bool = False


class Scene:
    """Draws a stage on the page.

    Args:
        server: The viser server.
        on_drag: Called with viser's event when a user drags the handle.
    """

    def __init__(self, server: Any, on_drag: Callable[[Any], Any]):
        self._on_drag = on_drag
        self._api = server.scene
        self._api.set_up_direction("+y")
        self._api.configure_environment_map(None)
        self._api.configure_default_lights(cast_shadow=False)
        self._api.add_light_ambient("/sky", color=(255, 255, 255), intensity=1.0)
        self._camera = server.initial_camera
        self._camera.fov = 0.6
        self.world = self._api.add_frame("/world", show_axes=False)
        self._api.add_line_segments("/world/floor", floor(), FLOOR, thickness=1.0, thickness_units="screen")
        self.handle = self._new_handle()
        self.grabbed = False
        """Whether a user holds the handle."""
        self._meshes: dict[str, Any] = {}
        self._mesh_key: Any = None

    def look_from(self, stage: Stage) -> None:
        """Sets the initial camera: it sees most of the garment, and shows the body to the left of the panel."""
        frame, garment = stage.frame, stage.source.garment
        body = frame.body.vertices, frame.body.faces
        right, _, back = view_axes(clearest_view([([(frame.vertices, garment.faces)], [body])]))
        middle = np.array([0.0, 0.9, 0.0]) + ASIDE * right
        self._camera.look_at, self._camera.position = middle, middle + AWAY * back

    def draw(self, stage: Stage, look: Look) -> None:
        """Shows the current frame of a stage."""
        self._prepare_meshes(stage)
        frame, garment = stage.frame, stage.source.garment
        cloth, truth = cloth_of(frame, look.shown), stage.truth
        scale = PAINTS[look.paint]
        values = None
        if scale is STRETCH:
            values = stretches(cloth, garment)
        elif scale is ERROR and truth is not None:
            values = errors(cloth, truth, garment)
        self._show("body", frame.body.vertices, look.body != "hidden")
        self._meshes["body"].opacity = SEE_THROUGH if look.body == "see-through" or look.mark else None
        self._show("cloth", cloth, values is None)
        parts = (
            [None] * len(COLOURS)
            if values is None or scale is None
            else split(cloth, garment.faces, scale.bands(values))
        )
        for number, part in enumerate(parts):
            mesh = self._meshes[f"band{number}"]
            if part is not None:
                mesh.vertices, mesh.faces = part
            mesh.visible = part is not None
        self._show("truth", truth, truth is not None)
        self._show("truth body", frame.body.vertices, truth is not None and look.body != "hidden")
        inside = cloth[inside_body(cloth, frame)] if look.mark else cloth[:0]
        self._points(inside)
        self._bones(stage, cloth, look.bones)
        self._colliders(stage, look.colliders)
        pelvis = frame.body.joints[0].astype(np.float64)
        if np.shape(self.handle.position) != (3,) or np.shape(self.handle.wxyz) != (
            4,
        ):  # viser keeps whatever it is sent
            self.handle.remove()
            self.handle = self._new_handle()
        self.handle.visible = look.handle
        if not self.grabbed:  # while a user drags the handle, the ground stands still
            self.handle.position, self.handle.wxyz = pelvis, (1.0, 0.0, 0.0, 0.0)
            self.world.position = (-pelvis[0], 0.0, -pelvis[2]) if look.follow else (0.0, 0.0, 0.0)

    def _new_handle(self) -> Any:
        handle = self._api.add_transform_controls(
            "/world/handle", scale=HANDLE, disable_sliders=True, depth_test=False, visible=False
        )
        handle.on_update(self._on_drag)
        return handle

    def _prepare_meshes(self, stage: Stage) -> None:
        """Makes the meshes anew where garment or body have other triangles."""
        garment, body = stage.source.garment, stage.source.body.body
        if self._mesh_key == (garment.hash, body.name):
            return
        for mesh in self._meshes.values():
            mesh.remove()
        self._mesh_key, skin, cloth = (garment.hash, body.name), stage.frame.body.vertices, stage.frame.vertices
        self._meshes = {
            "body": self._mesh("body", skin, body.faces, BODY),
            "cloth": self._mesh("cloth", cloth, garment.faces, CLOTH, side="double"),
            "truth": self._mesh("truth", cloth, garment.faces, TRUTH, side="double", position=BESIDE),
            "truth body": self._mesh("truth-body", skin, body.faces, BODY, position=BESIDE),
        }
        for number, colour in enumerate(COLOURS):
            name = f"band{number}"
            self._meshes[name] = self._mesh(
                name, cloth[:3], np.array([[0, 1, 2]]), np.divide(colour, 255), side="double", flat_shading=True
            )

    def _mesh(self, name: str, vertices: np.ndarray, faces: np.ndarray, colour: Any, **options: Any) -> Any:
        rgb = tuple(round(255 * float(part)) for part in colour)
        return self._api.add_mesh_simple(
            f"/world/{name}", vertices, faces, color=rgb, cast_shadow=False, receive_shadow=False, **options
        )

    def _show(self, name: str, vertices: Vertices | None, visible: bool) -> None:
        mesh = self._meshes[name]
        if visible and vertices is not None:
            mesh.vertices = vertices
        mesh.visible = visible

    def _points(self, points: np.ndarray) -> None:
        if "inside" in self._meshes:
            self._meshes.pop("inside").remove()
        if len(points):
            self._meshes["inside"] = self._api.add_point_cloud(
                "/world/inside",
                points.astype(np.float32),
                RED,
                point_size=POINT,
                point_shape="circle",
                precision="float32",
            )

    def _bones(self, stage: Stage, cloth: Vertices, visible: bool) -> None:
        source = stage.source
        animator = source.player.animator if visible and isinstance(source, PlayedClip) else None
        if not isinstance(animator, AnimatorRopes):
            if "bones" in self._meshes:
                self._meshes.pop("bones").remove()
                self._meshes["cloth"].opacity = None
            return
        self._meshes["cloth"].opacity, ropes = SEE_THROUGH, animator.ropes
        nodes, below = ropes.positions_on(cloth), np.flatnonzero(ropes.parents >= 0)
        lines = np.stack([nodes[ropes.parents[below]], nodes[below]], axis=1).astype(np.float32)
        if "bones" in self._meshes and self._meshes["bones"].points.shape == lines.shape:
            self._meshes["bones"].points = lines
        else:
            self._meshes["bones"] = self._api.add_line_segments(
                "/world/bones", lines, BONE, thickness=LINE, thickness_units="screen"
            )

    def _colliders(self, stage: Stage, visible: bool) -> None:
        """Shows the colliders of a garment on ropes, and the body see-through."""
        source, posed = stage.source, stage.frame.body
        ropes = isinstance(source, PlayedClip) and isinstance(source.player.animator, AnimatorRopes)
        if "colliders" in self._meshes and not (visible and ropes):
            self._meshes.pop("colliders").remove()
        if not (visible and ropes):
            return
        self._meshes["body"].opacity = SEE_THROUGH
        vertices, faces = cone_surfaces(BodyPrimitives.fit(posed.shaped), posed.transforms)
        if "colliders" in self._meshes:
            self._meshes["colliders"].vertices = vertices
        else:
            self._meshes["colliders"] = self._mesh("colliders", vertices, faces, CONE)


def floor() -> np.ndarray:
    """Returns the lines of the floor, (lines, 2, 3) float32 [m]; they are much cheaper to draw than a grid shader.

    Each line is as long as a tile, since browsers draw long lines that continue behind the camera at a wrong depth.
    """
    at = np.arange(-TILES, TILES + 1, dtype=np.float32)
    ends = np.zeros((len(at), len(at) - 1, 2, 3), np.float32)
    ends[..., 0], ends[:, :, 0, 2], ends[:, :, 1, 2] = at[:, None, None], at[:-1], at[1:]
    ends = ends.reshape(-1, 2, 3)
    return np.concatenate([ends, ends[:, :, ::-1]])
