"""A writer of FBX text, for the tests of its reader: bones, one animation a name, and a square that a bone carries."""

import numpy as np
from scipy.spatial.transform import Rotation

from hemline.motions.bvh import Bvh

_SECOND = 46_186_158_000
"""Units of time of the format in a second."""


def fbx_of(bvh: Bvh, animations: tuple[str, ...] = ("take",)) -> str:
    """FBX text of a clip, in centimetres, with y up, at 30 frames a second; the root carries a square of 10 cm."""
    objects, links = [], []
    bones = [100 + joint for joint in range(len(bvh.skeleton.names))]
    for joint, (name, parent) in enumerate(zip(bvh.skeleton.names, bvh.skeleton.parents, strict=True)):
        place = ",".join(f"{x:.9g}" for x in bvh.skeleton.offsets[joint])
        objects.append(_entry("Model", bones[joint], f"Model::{name}", "LimbNode", [_p("Lcl Translation", place)]))
        links.append(f'C: "OO",{bones[joint]},{bones[parent] if parent >= 0 else 0}')
    number = 10_000
    for name in animations:
        stack, layer = number, number + 1
        stop = f'P: "LocalStop", "KTime", "Time", "",{_SECOND * (len(bvh.rotations) - 1) // 30}'
        objects += [_entry("AnimationStack", stack, f"AnimStack::{name}", "", [stop])]
        objects += [_entry("AnimationLayer", layer, "AnimLayer::base", "", [])]
        links.append(f'C: "OO",{layer},{stack}')
        number += 2
        tracks = [("Lcl Translation", 0, bvh.positions[0])]
        for joint in range(len(bones)):
            turned = Rotation.from_quat(bvh.rotations[:, joint][:, [1, 2, 3, 0]])
            tracks.append(("Lcl Rotation", joint, np.unwrap(turned.as_euler("xyz", degrees=True), axis=0, period=360)))
        for part, joint, values in tracks:
            node = number
            objects.append(_entry("AnimationCurveNode", node, f"AnimCurveNode::{part[4]}", "", []))
            links += [f'C: "OO",{node},{layer}', f'C: "OP",{node},{bones[joint]}, "{part}"']
            for axis in range(3):
                objects.append(_curve(node + 1 + axis, values[:, axis]))
                links.append(f'C: "OP",{node + 1 + axis},{node}, "d|{"XYZ"[axis]}"')
            number += 4
    objects.append(_SQUARE)
    links += ['C: "OO",1,2', 'C: "OO",2,0', 'C: "OO",3,1', 'C: "OO",4,3', f'C: "OO",{bones[0]},4']
    return _HEAD + "Objects:  {\n" + "\n".join(objects) + "\n}\nConnections:  {\n" + "\n".join(links) + "\n}\n"


def _p(name: str, values: str) -> str:
    return f'P: "{name}", "{name}", "", "A",{values}'


def _entry(kind: str, number: int, name: str, sort: str, properties: list[str]) -> str:
    inside = "\n".join(properties)
    return f'{kind}: {number}, "{name}", "{sort}" {{\nVersion: 100\nProperties70:  {{\n{inside}\n}}\n}}'


def _curve(number: int, values: np.ndarray) -> str:
    count = len(values)
    times = ",".join(str(_SECOND * frame // 30) for frame in range(count))
    keys = ",".join(f"{x:.9g}" for x in values)
    return (
        f'AnimationCurve: {number}, "AnimCurve::", "" {{\nKeyVer: 4008\nKeyTime: *{count} {{\na: {times}\n}}\n'
        f"KeyValueFloat: *{count} {{\na: {keys}\n}}\nKeyAttrFlags: *1 {{\na: 4\n}}\n"
        f"KeyAttrDataFloat: *4 {{\na: 0,0,0,0\n}}\nKeyAttrRefCount: *1 {{\na: {count}\n}}\n}}"
    )


_HEAD = """; FBX 7.4.0 project file
FBXHeaderExtension:  {
FBXHeaderVersion: 1003
FBXVersion: 7400
}
GlobalSettings:  {
Version: 1000
Properties70:  {
P: "UpAxis", "int", "Integer", "",1
P: "UpAxisSign", "int", "Integer", "",1
P: "FrontAxis", "int", "Integer", "",2
P: "FrontAxisSign", "int", "Integer", "",1
P: "CoordAxis", "int", "Integer", "",0
P: "CoordAxisSign", "int", "Integer", "",1
P: "UnitScaleFactor", "double", "Number", "",1
P: "TimeMode", "enum", "", "",6
}
}
"""
_ONE = "*16 {\na: 1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n}"
_SQUARE = f"""Geometry: 1, "Geometry::square", "Mesh" {{
Vertices: *12 {{
a: 0,0,0,10,0,0,10,10,0,0,10,0
}}
PolygonVertexIndex: *4 {{
a: 0,1,2,-4
}}
}}
Model: 2, "Model::square", "Mesh" {{
Version: 232
}}
Deformer: 3, "Deformer::skin", "Skin" {{
Version: 101
}}
Deformer: 4, "SubDeformer::hips", "Cluster" {{
Version: 100
Indexes: *4 {{
a: 0,1,2,3
}}
Weights: *4 {{
a: 1,1,1,1
}}
Transform: {_ONE}
TransformLink: {_ONE}
}}"""
