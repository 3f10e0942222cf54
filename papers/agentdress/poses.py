"""The poses that stand for the clips, drawn: `python -m papers.agentdress.poses ANCHORS`.

ANCHORS is what `hemline drape GARMENT --anchors ...` made. Each pose that was settled on several bodies, the anchors
among them, is drawn on the mean one, those of the most turned arms first. The picture
papers/agentdress/pages/anchors-GARMENT.png is written anew.
"""

import argparse
from pathlib import Path

import numpy as np

from hemline import bodies, pictures
from hemline.datasets import Dataset, Take, open_dataset
from hemline.motions.motion import JOINT_NAMES
from hemline.motions.quaternions import angle

PAGES = Path(__file__).parents[2] / "papers" / "agentdress" / "pages"
SIZE, COLUMNS = (100, 140), 15
"""Of each picture [pixels]; pictures in a row."""
ARMS = [JOINT_NAMES.index(name) for name in ("left_shoulder", "right_shoulder")]


def anchors_of(dataset: Dataset) -> list[Take]:
    """Takes of the mean body in poses that were settled on other shapes, too."""
    by_pose: dict[str, list[Take]] = {}
    for row in dataset.anchors():
        take = dataset.take(row)
        if not take.derivatives:
            by_pose.setdefault(take.motion[0].hash, []).append(take)
    several = [takes for takes in by_pose.values() if len(takes) > 1]
    mean = [next((take for take in takes if not take.betas.any()), None) for takes in several]
    return [take for take in mean if take is not None]


def main() -> None:
    """Draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("anchors", type=Path)
    dataset = open_dataset(parser.parse_args().anchors)
    body, faces = bodies.load(dataset.garment.body_name).shaped(), dataset.garment.faces
    takes = sorted(anchors_of(dataset), key=lambda take: -float(angle(take.motion.rotations[0, ARMS]).sum()))
    drawn = []
    for take in takes:
        posed = body.posed(take.motion[0])
        meshes = [(posed.vertices, posed.faces, "body"), (take.vertices[0], faces, "cloth")]
        drawn.append(pictures.picture_of(meshes, "three_quarter", size=SIZE))
    drawn += [np.full_like(drawn[0], 255)] * (-len(drawn) % COLUMNS)
    rows = [pictures.side_by_side(drawn[begin : begin + COLUMNS]) for begin in range(0, len(drawn), COLUMNS)]
    path = PAGES / f"anchors-{dataset.garment.name}.png"
    pictures.write_png(path, np.concatenate(rows, axis=0))
    print(f"{path}: {len(takes)} anchors")


if __name__ == "__main__":
    main()
