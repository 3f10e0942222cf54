"""The part of `hemline explain` for clips: five lines, and a picture of the body beside the source's own skeleton."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float

if TYPE_CHECKING:
    from hemline.motions import Motion

_SIZE = (300, 420)
_BONES = (0.20, 0.42, 0.62)


@dataclass(frozen=True, eq=False)
class ExplainedClip:
    """What was understood of a clip.

    Attributes:
        motion: The clip.
        lines: Five sentences.
        places: Joints of the source in the first, the middle and the last frame [m].
        parents: Parent of each of these joints; -1: none.
    """

    motion: "Motion"
    lines: tuple[str, ...]
    places: Float[np.ndarray, "shown source_joints 3"]
    parents: tuple[int, ...]


def explain_clip(file: str, *, up: str | None) -> ExplainedClip:
    """Reads a clip and says what was understood.

    Args:
        file: A file, `FILE:NAME`, or the name of a shipped clip.
        up: The axis that is up in it; None: found.

    Raises:
        BadMotion: It cannot be read.
    """
    from hemline import motions
    from hemline.motions.figure import pose_figure
    from hemline.motions.read import has_skeleton, read_beside

    if not has_skeleton(file):
        motion = motions.open_motion(file, up=up)
        shown = _three_frames(motion)
        places = pose_figure(motion.rotations[shown], motion.translations[shown], motion.leg_length)
        joints = "the 24 joints of SMPL, in their order; the file has no skeleton: a plain figure stands in for it"
        lines = (
            _clip_line(motion),
            f"joints: {joints}",
            "rest pose: a T-pose, by the format",
            _up_line(motion, places),
        )
        return ExplainedClip(motion, (*lines, f"notes: {_notes(motion)}"), places, motions.PARENTS)
    source = read_beside(file, up=up)
    motion, match = source.motion, source.rig.match
    places = np.stack([source.places(frame) for frame in _three_frames(motion)])
    worst = max(source.bone_errors, key=lambda bone: source.bone_errors[bone])
    mean = np.mean(list(source.bone_errors.values()))
    return ExplainedClip(
        motion,
        (
            _clip_line(motion),
            f"joints: {len(match.joints) + len(match.spine)} of {len(source.rig.skeleton.names)}, by "
            f"{match.how or 'their names'}",
            f"rest pose: {source.rest or 'a T-pose, or one with limbs that were turned to it'}",
            f"{_up_line(motion, pose_figure(motion.rotations, motion.translations, motion.leg_length))}; "
            f"{source.up} is up in the file",
            f"bones: within {mean:.1f} degrees of the source in the mean, {worst} within "
            f"{source.bone_errors[worst]:.0f}; {_notes(motion)}",
        ),
        places,
        _below(source.rig.skeleton.parents, match.joints["pelvis"]),
    )


def draw_clip(path: Path, clip: ExplainedClip) -> None:
    """Writes a picture of the source's skeleton and of the body in the first, the middle and the last frame.

    Raises:
        BadOutput: The path cannot be written.
    """
    from hemline import bodies
    from hemline.bodies.place import place_motion
    from hemline.pictures import picture_of, side_by_side, write_png
    from hemline.pictures.bones import bone_mesh

    shaped = bodies.load().shaped(())
    motion = place_motion(shaped, clip.motion)
    pictures, captions = [], []
    for place, frame in enumerate(_three_frames(motion)):
        posed = shaped.posed(motion[frame])
        scale = motion.leg_length / clip.motion.leg_length
        skeleton = scale * clip.places[place]
        both = ((bone_mesh(skeleton, clip.parents), "the source"), ((posed.vertices, shaped.body.faces), "the body"))
        for mesh, name in both:
            colour = _BONES if name == "the source" else "body"
            pictures.append(picture_of([(*mesh, colour)], "three_quarter", size=_SIZE))
            captions.append(f"{name}, frame {frame}")
    write_png(path, side_by_side(pictures, captions))


def _below(parents: tuple[int, ...], pelvis: int) -> tuple[int, ...]:
    """Returns the parents of the joints that the pelvis carries; -1 for all others, such as controls."""
    carried = {pelvis}
    for joint, parent in enumerate(parents):
        if parent in carried:
            carried.add(joint)
    return tuple(parent if parent in carried else -1 for parent in parents)


def _three_frames(motion: "Motion") -> list[int]:
    return [0, (len(motion) - 1) // 2, len(motion) - 1]


def _clip_line(motion: "Motion") -> str:
    length = f"{len(motion)} frame{'s' * (len(motion) != 1)} at {motion.fps:g} a second, {motion.seconds:.3g} s"
    way = np.ptp(motion.translations, axis=0)
    return f"clip: '{motion.name}', {length}, legs of {motion.leg_length:.2f} m, over {way[0]:.1f} x {way[2]:.1f} m"


def _up_line(motion: "Motion", places: Float[np.ndarray, "frames joints 3"]) -> str:
    from hemline.motions import JOINT_NAMES

    head = places[:, JOINT_NAMES.index("head")] - places[:, 0]
    erect = 100 * float((head[:, 1] > 0.7 * np.linalg.norm(head, axis=1)).mean())
    return f"up: the head is {head[:, 1].mean():.2f} m above the pelvis, the body erect in {erect:.0f} % of the frames"


def _notes(motion: "Motion") -> str:
    """Returns the notes that no other line holds."""
    others = [note for note in motion.notes if not note.startswith(("joints found", "zero pose", "the zero"))]
    return "; ".join(others)
