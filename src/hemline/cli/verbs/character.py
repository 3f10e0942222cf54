"""`hemline character MODEL -o FILE.vrm`."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import tyro


@dataclass(frozen=True)
class CharacterOptions:
    """Options of `hemline character`."""

    model: Annotated[str, tyro.conf.Positional]
    """Model of rope chains: a file, or the name of a shipped model (cape, skirt, knee-dress, robe)."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """File to write (.vrm)."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape."""
    body: str | None = None
    """Body to use, with the topology of the model's body. Defaults to the body of the model."""
    takes: Path | None = None
    """Dataset of the model's garment, made by simulate, to which the springs are tuned in a few minutes.
    By default they have the constants that are stored in the model."""
    weights: int = 4
    """Largest number of bones that move a vertex, 1 to 4.
    Phones and some engines allow 2."""
    table: Path | None = None
    """File to write (.json) with the constants of each chain for KawaiiPhysics, PhysBones and Magica Cloth 2.
    By default none is written."""
    json: bool = False
    """Print one JSON object with file, size [bytes], and numbers of vertices, chains, bones and colliders."""


def run(options: CharacterOptions) -> int:
    """Settles the garment in the T-pose and writes the file."""
    from hemline.animators import load
    from hemline.cli.model import body_of
    from hemline.export import check_character_path, check_table_path, write_spring_table, write_vrm
    from hemline.playback import character

    check_character_path(options.output)
    if options.table:
        check_table_path(options.table)
    model = load(options.model)
    if options.takes:
        model = _tuned(model, options.takes)
    person = character(model, body_of(model, options.body, options.betas), influences=options.weights)
    write_vrm(options.output, person)
    if options.table:
        write_spring_table(options.table, person)
    if not options.json:
        print(*filter(None, (options.output, options.table)), sep="\n")
        return 0
    summary = {
        "file": str(options.output),
        "bytes": options.output.stat().st_size,
        "vertices": {mesh.name: len(mesh.vertices) for mesh in person.meshes},
        "chains": len(person.chains.joints),
        "bones": len(person.chains.bones),
        "colliders": len(person.capsules.joints),
    }
    print(json.dumps(summary))
    return 0


def _tuned(model: Any, folder: Path) -> Any:
    """Returns a model whose spring bones are tuned to the takes of a dataset."""
    from hemline.animators.ropes import AnimatorRopes
    from hemline.animators.ropes.springs.tuning import tune_springs
    from hemline.cli.progress import stages
    from hemline.datasets import open_dataset

    if not isinstance(model, AnimatorRopes):
        return model  # `character` says why it cannot be written
    with stages() as progress:
        constants, _ = tune_springs(model, open_dataset(folder), progress)
    return replace(model, springs=constants)
