"""A garment, which consists of cloth, pins and a material."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.arrays import Betas, Faces, Float, Int, Vertices
from hemline.errors import BadGarment, BadInput
from hemline.files import content_hash, read_tensors, write_tensors
from hemline.motions.motion import JOINT_NAMES

from .dressing import dress_vertices
from .material import Material
from .pieces import Piece, face_pieces, separate_pieces
from .pins import Pins
from .thumbnail import figure_html, thumbnail
from .validation import check_chains, check_pieces, validate_mesh, validate_pins

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_SOFT_PIN_ARRAYS = ("pin_stiffness",)
"""Arrays that only files with soft pins have."""

_JOINT_PIN_ARRAYS = ("pin_joints", "pin_offsets")
"""Arrays that only files with pins on joints have."""

_ARRAYS = ("vertices", "faces", "rest_edges", "pin_vertices", "pin_body_faces", "pin_barycentric", "pin_heights")


@dataclass(frozen=True, eq=False)
class Garment:
    """Cloth ready to be simulated on a body.

    Raises:
        BadGarment: Arrays, pins or chains contradict each other.
    """

    name: str
    """Name in files and error messages."""
    vertices: Vertices
    """Start positions in the world of the body's rest pose, float32 [m]."""
    faces: Faces
    """Triangles, int32, counter-clockwise from outside."""
    rest_edges: Float[np.ndarray, "faces 2 2"]
    """The flat rest triangles, float64: columns are the edges from the first corner to the second and third [m]."""
    material: Material
    """Material of the cloth; if there are several pieces, that of the innermost one."""
    pins: Pins
    """Vertices that follow the body."""
    key_joint: str
    """The joint whose frame carries the garment as a whole: neck for a cape, pelvis for a skirt."""
    chains: Sequence[Sequence[int]] = ()
    """Rope chains that were made by hand, each a row of vertex ids from root to tip. If empty, a fit lays them out."""
    body_name: str = "anny24"
    """Name of the body that it was made on."""
    body_betas: Betas = None  # type: ignore[assignment]  # the mean shape, set below
    """Shape of the body that it was made on, float32."""
    flat_rest: bool = True
    """Whether the cloth is flat when nothing bends it; otherwise the rest angles are those of `vertices`."""
    notes: tuple[str, ...] = ()
    """What was guessed or changed when it was made, and why, one sentence each."""
    pieces: tuple[Piece, ...] = ()
    """Pieces of cloth from the skin outwards; empty if there is just one. See `layers` and `wear_together`."""

    def __post_init__(self) -> None:
        betas = () if self.body_betas is None else self.body_betas
        object.__setattr__(self, "body_betas", np.atleast_1d(np.asarray(betas, np.float32)))
        object.__setattr__(self, "chains", tuple(tuple(int(each) for each in chain) for chain in self.chains))
        object.__setattr__(self, "notes", tuple(str(note) for note in self.notes))
        what = f"garment '{self.name}'"
        vertices, faces, rest_edges = validate_mesh(what, self.vertices, self.faces, self.rest_edges)
        pins = validate_pins(what, self.pins, len(vertices))
        check_chains(self.chains, len(vertices), what)
        check_pieces(what, self.pieces, self.material, faces, len(vertices))
        for name, value in (("vertices", vertices), ("faces", faces), ("rest_edges", rest_edges), ("pins", pins)):
            object.__setattr__(self, name, value)
        if self.key_joint not in JOINT_NAMES:
            raise BadGarment(
                f"garment '{self.name}': unknown key joint",
                f"'{self.key_joint}'",
                f"use one of {', '.join(JOINT_NAMES)}",
            )

    @property
    def layers(self) -> tuple[Piece, ...]:
        """Pieces of cloth from the skin outwards, at least one."""
        return self.pieces or (Piece(self.name, len(self.vertices), self.material, self.flat_rest),)

    @property
    def face_pieces(self) -> Int[np.ndarray, " faces"]:
        """Number of the piece that each face belongs to."""
        return face_pieces(self.layers, self.faces)

    @property
    def densities(self) -> Float[np.ndarray, " faces"]:
        """Area density of each face [kg/m^2]."""
        return np.array([piece.material.density for piece in self.layers])[self.face_pieces]

    @property
    def facts(self) -> str:
        """Name, numbers of vertices and triangles, materials and size in one line."""
        size = " x ".join(f"{each:.2f}" for each in np.ptp(self.vertices, axis=0))
        materials = ", ".join(dict.fromkeys(piece.material.name for piece in self.layers))
        return f"{self.name}: {len(self.vertices)} vertices, {len(self.faces)} triangles, {materials}, {size} m"

    def _repr_html_(self) -> str:
        """Shows the garment in a notebook: a picture from the front, and a line of facts."""
        return figure_html(thumbnail(self.vertices, self.faces), self.facts)

    def in_material(self, material: Material) -> "Garment":
        """Returns this garment made of another material.

        Raises:
            BadGarment: The garment has several pieces, each with a material of its own.
        """
        if self.pieces:
            names = ", ".join(piece.name for piece in self.pieces)
            raise BadGarment(f"'{self.name}' has pieces of different cloth", names, "change the material of each piece")
        return replace(self, material=material)

    @cached_property
    def hash(self) -> str:
        """Short hash of the content without name and notes."""
        metadata = {key: value for key, value in self.metadata().items() if key not in ("name", "notes")}
        return content_hash(*self.arrays().values(), metadata)

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns all arrays by name, as they are stored in files, where a hard pin has the stiffness 0."""
        pins = self.pins
        parts = (pins.vertices, pins.body_faces, pins.barycentric, pins.heights)
        every = (self.vertices, self.faces, self.rest_edges, *parts)
        arrays: dict[str, np.ndarray] = dict(zip(_ARRAYS, every, strict=True))
        hard = np.isinf(pins.stiffness)
        if not hard.all():
            arrays[_SOFT_PIN_ARRAYS[0]] = np.where(hard, np.float32(0), pins.stiffness)
        if (pins.joints >= 0).any():
            arrays |= dict(zip(_JOINT_PIN_ARRAYS, (pins.joints, pins.offsets), strict=True))
        return arrays

    def metadata(self) -> dict[str, Any]:
        """Returns everything that is not an array, as JSON-like values."""
        return {
            "name": self.name,
            "material": self.material.as_dict(),
            "key_joint": self.key_joint,
            "chains": [list(chain) for chain in self.chains],
            "body_name": self.body_name,
            "body_betas": [float(beta) for beta in self.body_betas],
            "flat_rest": self.flat_rest,
            "notes": list(self.notes),
        } | ({"pieces": [piece.as_dict() for piece in self.pieces]} if self.pieces else {})

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> "Garment":
        """Makes the garment that `arrays` and `metadata` describe; other keys are ignored.

        Raises:
            BadGarment: An array or a key is missing, of the wrong type, or contradicts the others.
        """
        cure = "make the file again"
        joint_pins = _JOINT_PIN_ARRAYS if any(name in arrays for name in _JOINT_PIN_ARRAYS) else ()
        missing = [name for name in (*_ARRAYS, *joint_pins) if name not in arrays] + [
            key
            for key in ("name", "material", "key_joint", "body_name", "body_betas", "flat_rest")
            if key not in metadata
        ]
        if missing:
            raise BadGarment("a garment must have all its arrays and keys", f"no {', '.join(missing)}", cure)
        try:
            return cls(
                name=str(metadata["name"]),
                vertices=arrays["vertices"],
                faces=arrays["faces"],
                rest_edges=arrays["rest_edges"],
                material=Material.of(metadata["material"]),
                pins=_pins(arrays),
                key_joint=str(metadata["key_joint"]),
                chains=metadata.get("chains", ()),
                body_name=str(metadata["body_name"]),
                body_betas=np.array(metadata["body_betas"], np.float32),
                flat_rest=bool(metadata["flat_rest"]),
                notes=tuple(metadata.get("notes", ())),
                pieces=tuple(Piece.of(each) for each in metadata.get("pieces", ())),
            )
        except BadInput:
            raise
        except (TypeError, ValueError, KeyError, AttributeError, OverflowError, RecursionError) as error:
            raise BadGarment("a garment must have readable metadata", "values of the wrong kind", cure) from error

    def save(self, path: str | Path) -> None:
        """Writes the garment to a hemline file (safetensors, kind `garment`).

        Raises:
            BadOutput: The path cannot be written.
        """
        write_tensors(path, self.arrays(), {"kind": "garment"} | self.metadata())

    @classmethod
    def load(cls, path: str | Path) -> "Garment":
        """Reads a garment from a hemline file of kind `garment`.

        Raises:
            BadGarment: The file is missing, damaged, of another kind or of a future version.
        """
        return cls.of(*read_tensors(path, "garment", error=BadGarment))

    def is_on(self, shaped: "ShapedBody") -> bool:
        """Whether the garment was made on, or dressed on, exactly this body and shape."""
        return self.body_name == shaped.body.name and np.array_equal(
            np.trim_zeros(self.body_betas, "b"), np.trim_zeros(shaped.betas, "b")
        )

    def check_pins_on(self, shaped: "ShapedBody") -> None:
        """Checks that a body has the triangles that the pins are bound to.

        Raises:
            BadGarment: A pin names a triangle that the body does not have.
        """
        highest, count = self.pins.body_faces.max(initial=-1), len(shaped.body.faces)
        if highest >= count:
            what = f"garment '{self.name}': pins name a body face that does not exist"
            raise BadGarment(what, f"{highest}; {shaped.body.name} has {count}", "make the garment again on this body")

    def dressed(self, shaped: "ShapedBody") -> "Garment":
        """Returns this garment moved onto another shape of its body; its rest triangles and material stay the same.

        Args:
            shaped: The body to wear it.

        Returns:
            A garment whose start positions are outside that body and whose pins are on it; the garment itself if it
            was made on that shape.

        Raises:
            BadGarment: The garment was made on another body, or the body lacks triangles that its pins are bound to.
        """
        if shaped.body.name != self.body_name:
            what = f"garment '{self.name}' was made on {self.body_name}"
            raise BadGarment(what, f"a body called {shaped.body.name}", "read its mesh again with that body")
        self.check_pins_on(shaped)
        if self.is_on(shaped):
            return self
        made_on = shaped.body.shaped(self.body_betas)
        vertices = dress_vertices(self.vertices, self.faces, self.rest_edges, self.pins, made_on, shaped)
        dressed = replace(self, vertices=vertices.astype(np.float32), body_betas=np.array(shaped.betas, np.float32))
        return dressed.separate_pieces() if self.pieces else dressed

    def separate_pieces(self) -> "Garment":
        """Returns this garment with each piece moved outside of those beneath it, pins included."""
        vertices, pins = separate_pieces(self.vertices, self.faces, self.pins, self.layers)
        return replace(self, vertices=vertices, pins=pins)


def _pins(arrays: Mapping[str, np.ndarray]) -> Pins:
    stiffness = arrays.get(_SOFT_PIN_ARRAYS[0])
    return Pins(
        *(arrays[name] for name in _ARRAYS[3:]),
        *(arrays.get(name) for name in _JOINT_PIN_ARRAYS),
        stiffness=None if stiffness is None else np.where(stiffness == 0, np.inf, stiffness),  # type: ignore[arg-type]
    )
