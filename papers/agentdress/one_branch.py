"""Whether drapes that agree make a better model: `python -m papers.agentdress.one_branch ANCHORS FOLDER`.

Friction and folds leave a garment many places to rest in one pose. Drapes that were reached by walks from the rest pose
fall into different ones, and a model blends what does not belong together. Here each garment is settled again, in the
same pose on the same body, from what a model says that was fitted to the drapes in other poses (four folds of poses).
That is a round; the next one starts from its drapes.

ANCHORS is a dataset made by `hemline drape --anchors --random`; its garments on the mean body and on random bodies are
used. FOLDER takes the drapes of each round; it is made and continued. All rounds are judged in three ways: by the
drapes of other folds in the same round; by the same drapes as they were walked; and, with the model that all drapes of
a round give, by a simulation in motion, which knows of no round.

Writes papers/agentdress/pages/one_branch.md and a row in benchmarks/results/agentdress_one_branch.jsonl.
"""

from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Bool
from hemline.compiled import use_threads
from hemline.datasets import Dataset, Take, create, open_dataset
from hemline.errors import SimulationFailed
from hemline.meshes import crossing_edges, edge_strains
from hemline.sim import SimSettings
from hemline.sim.rest.damped import run_damped
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd
from papers.agentdress.models.in_motion import distances_in_motion
from papers.agentdress.settled.pairs import mean_distance_mm
from papers.report import ROOT, Page, Row, origin_of, parse_options, record

NAME = "agentdress_one_branch"
PAGES = ROOT / "papers" / "agentdress" / "pages"
FOLDS = 4
STILL_SECONDS, VELOCITY_RATIO = 1.0, 0.9
"""Time for which a garment is settled again, and fraction of the velocity that a frame leaves, as in a walk."""
STILL_SPEED = 1e-4
"""Mean speed at which it may end earlier [m/s]."""
COLUMNS = {
    "left out, mean body, mm": ".2f",
    "left out, random bodies, mm": ".2f",
    "of the walked drapes, mean body, mm": ".2f",
    "of the walked drapes, random bodies, mm": ".2f",
    "from the simulation in motion, mm": ".2f",
    "moved in this round, mm": ".2f",
    "stretch p99, %": ".1f",
    "edges through cloth, %": ".2f",
}


def write_page(row: Row) -> str:
    """Writes the page; returns the text."""
    page = Page("Drapes that agree with each other")
    page.text(origin_of(row, "python -m papers.agentdress.one_branch ANCHORS FOLDER"))
    page.text(f"""
        {row["garment"]}, {row["mean"]} poses on the mean body and {row["random"]} random bodies in some of them. Each
        round settles all of them again, each from what a model says that was fitted to the poses of the other
        {FOLDS - 1} of {FOLDS} folds; round 0 are the drapes as they were walked. "Left out" is the error on the drapes
        of the same round that the model does not know, "of the walked drapes" the error of the same model on round 0.
        The simulation in motion judges the model of all drapes of a round in a walk of a person who appears in no fit,
        on the mean body. Stretch and crossings are those of the drapes.
    """)
    page.table({"round": "d", **COLUMNS}, ([number, *values] for number, values in enumerate(row["rounds"])))
    return page.write(PAGES / "one_branch.md")


def first_round(source: Dataset, folder: Path, most: int) -> Dataset:
    """Copies the T-poses, and garments on the mean body and on random ones, at most some of each, into a dataset.

    Poses in which garments on random bodies are taken come first on the mean body.
    """
    drapes = create(folder, source.garment)
    on_mean: list[Take] = []
    on_random: list[Take] = []
    for row in source.anchors():
        take = source.take(row)
        if take.derivatives:
            if np.abs(take.motion.rotations[0, :, 0]).min() > 1 - 1e-6:
                drapes.add(take)
        elif not any(row.betas):
            on_mean.append(take)
        elif any(row.betas[4:]):
            on_random.append(take)
    on_random = on_random[:most]
    poses = {take.motion[0].hash for take in on_random}
    on_mean.sort(key=lambda take: take.motion[0].hash not in poses)
    for take in (*on_mean[:most], *on_random):
        drapes.add(take)
    return drapes


def judged(dataset: Dataset) -> list[Take]:
    """Returns the garments of a round, without the T-poses."""
    takes = (dataset.take(row) for row in dataset.anchors())
    return [take for take in takes if not take.derivatives]


def fold_of(take: Take) -> int:
    """Returns the number of the fold of a take, which depends on its pose alone."""
    return int(take.motion[0].hash, 16) % FOLDS


def models_of_folds(dataset: Dataset) -> list[AnimatorAgentDress]:
    """Fits a model without each fold of the poses, in their order."""
    anchors = AnchorSet.of(dataset)
    folds = {take.motion.rotations[0].astype(np.float64).tobytes(): fold_of(take) for take in judged(dataset)}
    of_pose = np.array([folds[rotations.tobytes()] for rotations in anchors.rotations])
    models = []
    for fold in range(FOLDS):
        others = anchors.subset(np.flatnonzero(of_pose != fold), np.empty(0, int))
        models.append(fit_anchors(dataset.garment, others, AgentDressConfig(), progress=lambda *_: None))
    return models


def settle_again(take: Take, garment_folder: str, start: np.ndarray) -> tuple[np.ndarray, Bool[np.ndarray, " verts"]]:
    """Settles the garment of a take from other positions; returns vertices [m] and a mask of the pinched ones."""
    use_threads(1)
    dataset = open_dataset(garment_folder)
    shaped = dataset.body.shaped(take.betas)
    posed, end = shaped.posed(take.motion[0]), FrameEnd(dataset.garment, shaped)
    dressed = DressedBody(dataset.garment, shaped, SimSettings())
    outside = end.clean(posed, start.astype(np.float64), 1.0).positions
    how = {"seconds": STILL_SECONDS, "velocity_ratio": VELOCITY_RATIO, "still": STILL_SPEED}
    state = run_damped(dressed, end, posed, outside, **how)
    return state.positions.astype(np.float32), state.pinched


def next_round(dataset: Dataset, folder: Path, jobs: int) -> Dataset:
    """Settles all garments of a round again, into a dataset that is continued if it exists.

    A garment that fails, or of which more is pinched than before, keeps its place.
    """
    after = create(folder, dataset.garment)
    for row in dataset.anchors():
        take = dataset.take(row)
        if take.derivatives:
            after.add(take)
    done = {(take.motion[0].hash, take.betas.tobytes()) for take in judged(after)}
    missing = [take for take in judged(dataset) if (take.motion[0].hash, take.betas.tobytes()) not in done]
    if not missing:
        return after
    models = models_of_folds(dataset)
    with ProcessPoolExecutor(jobs) as pool:
        starts = [drape_of(models[fold_of(take)], take) for take in missing]
        calls = [
            pool.submit(settle_again, take, str(dataset.folder), x) for take, x in zip(missing, starts, strict=True)
        ]
        for take, call in zip(missing, calls, strict=True):
            vertices, pinched = take.vertices[0], int(take.pinched[0])
            try:
                found, stuck = call.result()
                if stuck.sum() <= max(pinched, 0.05 * len(stuck)):
                    vertices, pinched = found, int(stuck.sum())
            except SimulationFailed:
                pass
            inputs = dict(take.inputs) | {"start": f"settled again from {dataset.folder.name}"}
            new = {"vertices": vertices[None], "pinched": np.array([pinched], np.int32), "inputs": inputs}
            after.add(Take(**{**vars(take), **new}))
    return after


def drape_of(model: AnimatorAgentDress, take: Take) -> np.ndarray:
    """Returns what a model says of the pose and body of a take [m]."""
    return model.drape(bodies.load(model.body_name).shaped(take.betas).posed(take.motion[0]))


def figures_of(dataset: Dataset, before: Dataset, walked: Dataset, folder: Path, jobs: int) -> list[float]:
    """Returns the figures of a round, in the order of the columns of the page."""
    garment, models = dataset.garment, models_of_folds(dataset)
    earlier, first = by_pose_and_body(before), by_pose_and_body(walked)
    own: dict[bool, list[float]] = {True: [], False: []}
    of_walked: dict[bool, list[float]] = {True: [], False: []}
    moved, stretch, through = [], [], []
    for take in judged(dataset):
        key, on_mean = (take.motion[0].hash, take.betas.tobytes()), not take.betas.any()
        predicted = drape_of(models[fold_of(take)], take)
        own[on_mean].append(mean_distance_mm(predicted, take.vertices[0]))
        of_walked[on_mean].append(mean_distance_mm(predicted, first[key].vertices[0]))
        moved.append(mean_distance_mm(take.vertices[0], earlier[key].vertices[0]))
        strains = edge_strains(take.vertices[0], garment.faces, garment.rest_edges)
        stretch.append(100 * float(np.percentile(strains, 99)))
        through.append(100 * len(crossing_edges(take.vertices[0], garment.faces)) / len(strains))
    whole = fit_anchors(garment, AnchorSet.of(dataset), AgentDressConfig(), progress=lambda *_: None)
    in_motion = distances_in_motion(folder, {"model": whole}, None, jobs=jobs)["model, as shown"]
    parts = own[True], own[False], of_walked[True], of_walked[False], in_motion, moved, stretch, through
    return [round(float(np.mean(part)), 3) for part in parts]


def by_pose_and_body(dataset: Dataset) -> dict[tuple[str, bytes], Take]:
    """Returns the garments of a round by pose and betas."""
    return {(take.motion[0].hash, take.betas.tobytes()): take for take in judged(dataset)}


def main() -> None:
    """Settles the rounds, judges them, records and writes the page."""
    options = parse_options(
        __doc__,
        "anchors",
        "folder",
        rounds=(2, "number of rounds"),
        most=(400, "largest number of garments on the mean body, and on random ones"),
        jobs=1,
    )
    use_threads(1)
    walked = first_round(open_dataset(options.anchors), options.folder / "round-0", options.most)
    data = [walked]
    for number in range(options.rounds):
        data.append(next_round(data[-1], options.folder / f"round-{number + 1}", options.jobs))
    rounds = [
        figures_of(each, data[max(number - 1, 0)], walked, options.folder / "in-motion", options.jobs)
        for number, each in enumerate(data)
    ]
    on_mean = [not take.betas.any() for take in judged(walked)]
    row = {
        "garment": walked.garment.name,
        "mean": sum(on_mean),
        "random": len(on_mean) - sum(on_mean),
        "rounds": rounds,
    }
    print(write_page(*record(NAME, row, threads=options.jobs)))


if __name__ == "__main__":
    main()
