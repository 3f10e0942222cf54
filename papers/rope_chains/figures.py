"""The figures of the paper, redrawn with measurements.

Run `python -m papers.rope_chains.figures MODEL TAKES TRUTH [--only 4 5]`. MODEL is a file or the name of a shipped
model, TAKES the dataset of its fit, TRUTH a dataset of clips that were not part of a fit. The script writes the page
papers/rope_chains/pages/figures-NAME.md and its pictures. Each figure has the statement of the paper, the measurement
here, and whether the statement holds. `--only` draws some figures and prints their measurements, without the page.
"""

import argparse
from pathlib import Path

import hemline
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from papers.rope_chains.drawing import (
    fig03_net,
    fig04_pendulum,
    fig05_sweeps,
    fig07_history,
    fig08_components,
    fig09_networks,
    fig15_played,
)

PAGES = Path(__file__).parents[2] / "papers" / "rope_chains" / "pages"
PAGE = """\
# The figures of Jin et al. 2024, redrawn: {name}

Written by `python -m papers.rope_chains.figures {model} TAKES TRUTH` at commit {commit}, on {machine}, one
thread. TAKES, the dataset of the fit, had {takes} takes; TRUTH holds clips of subjects that were not part of it.

{figures}
"""
ENTRY = """\
## Fig. {number}: {title}

![{title}]({folder}/{picture})

The paper: {paper}

Here: {measured} {holds}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description="The paper's figures, redrawn.")
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("takes", type=Path, help="the dataset of the fit")
    parser.add_argument("truth", type=Path, help="a dataset of clips that the model was not fitted to")
    parser.add_argument("--only", nargs="+", help="numbers of figures: 3 4 5 7 8 9 15; 9 stands for 9 to 12")
    options = parser.parse_args()
    use_threads(1)
    model = hemline.load(options.model)
    takes, truth = (hemline.datasets.open_dataset(folder) for folder in (options.takes, options.truth))
    folder = PAGES / f"figures-{model.garment.name}"
    drawings = {
        "3": lambda: [fig03_net.draw(folder)],
        "4": lambda: [fig04_pendulum.draw(folder)],
        "5": lambda: [fig05_sweeps.draw(folder)],
        "7": lambda: [fig07_history.draw(folder)],
        "8": lambda: [fig08_components.draw(folder, model)],
        "9": lambda: fig09_networks.draw(folder, model, takes),
        "15": lambda: [fig15_played.draw(folder, model, truth)],
    }
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for number, draw in drawings.items():
        if options.only and number not in options.only:
            continue
        for drawn in draw():
            entries.append(ENTRY.format(folder=folder.name, **vars(drawn)))
            print(f"Fig. {drawn.number}: {drawn.measured} {drawn.holds}", flush=True)
    if not options.only:
        text = PAGE.format(
            name=model.garment.name,
            model=Path(options.model).name,
            commit=commit(),
            machine=machine(),
            takes=len(takes.clips()),
            figures="\n".join(entries),
        )
        (PAGES / f"figures-{model.garment.name}.md").write_text(text)


if __name__ == "__main__":
    main()
