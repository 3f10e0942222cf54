"""What can go wrong, as one tree.

```
HemlineError
├── BadInput (also a ValueError)     the user's file or argument: exit status 2
│   ├── BadBody       betas, body files
│   ├── BadMotion     clips
│   ├── BadMesh       triangles
│   ├── BadGarment    mesh + TOML, pins, chains, materials
│   │   └── OffBody   a garment that does not sit on the body
│   ├── BadDataset    folders of takes
│   │   └── DamagedTake  a take that was read to its end and is not whole: it can be made again
│   ├── BadModel      model files
│   ├── BadAnswer     what the page of a study sent
│   ├── BadCluster    a scheduler, its workers, the processes of a training
│   └── BadOutput     a path that cannot be written, a format that is not known
├── MissingExtra (also an ImportError)   an optional library is not installed: exit status 2
└── SimulationFailed                     a take that could not be finished: exit status 1

HemlineWarning (a UserWarning)           goes on, but the result will be worse: one line on stderr
```

Every message says what, got, cure: `skirt.toml: pins name vertex 4120; the mesh has 3980 vertices; count from 0`.
"""


class HemlineError(Exception):
    """Base of everything that hemline raises on purpose."""


class BadInput(HemlineError, ValueError):
    """Input that cannot be used as it is.

    Args:
        what: What is wrong, and where.
        got: What was found.
        cure: What the user can do about it.
    """

    def __init__(self, what: str, got: object, cure: str):
        self.what, self.got, self.cure = what, got, cure
        super().__init__(_one_line(what, got, cure))

    def __reduce__(self):
        return type(self), (self.what, self.got, self.cure)


class BadBody(BadInput):
    """Betas of the wrong length, a body file that is not one."""


class BadMotion(BadInput):
    """A clip that cannot be read, or that lacks a joint."""


class BadMesh(BadInput):
    """A triangle mesh that cloth cannot be made of."""


class BadGarment(BadInput):
    """A garment whose mesh, unit, pins, chains or material contradict each other."""


class OffBody(BadGarment):
    """A garment that does not sit on the body; trying it on may help."""


class BadDataset(BadInput):
    """A dataset that is damaged, or that was made for something else."""


class DamagedTake(BadDataset):
    """A take that was read and is not whole: cut off, or other bytes than a take's.

    What could not be read at all (no permission, a disk that fails), what a newer hemline wrote and what is another
    take than its name says is a `BadDataset` and never this: it may be whole.
    """


class BadModel(BadInput):
    """A model file that is damaged, of a future version, or not one."""


class BadAnswer(BadInput):
    """What the page of a study sent and cannot be kept. The page shows the message, so it names no clip."""


class BadCluster(BadInput):
    """A scheduler that does not answer, workers that cannot do the work, processes that do not fit a training."""


class BadOutput(BadInput):
    """A path that cannot be written, or an ending that names no known format."""


class MissingExtra(HemlineError, ImportError):
    """An optional library is needed and not installed.

    Args:
        module: The library's import name.
        extra: The extra of hemline that brings it.
        need: What it is needed for.
    """

    def __init__(self, module: str, extra: str, need: str):
        self.module, self.extra, self.need = module, extra, need
        super().__init__(f"{need} needs {module}; it is not installed; run: pip install 'hemline[{extra}]'")

    def __reduce__(self):
        return type(self), (self.module, self.extra, self.need)


class SimulationFailed(HemlineError):
    """A step failed even at the smallest substep; the message names frame and reason."""


class HemlineWarning(UserWarning):
    """What can be used, though the result will be worse for it.

    Args:
        what: What is doubtful; or the whole line, where a library that held a warning back gives it again by its text.
        got: What was found.
        cure: What the user can do about it.
    """

    def __init__(self, what: str, got: object = "", cure: str = ""):
        self.what, self.got, self.cure = what, got, cure
        super().__init__(_one_line(what, got, cure) if cure else what)

    def __reduce__(self):
        return type(self), (self.what, self.got, self.cure)


def _one_line(what: str, got: object, cure: str) -> str:
    """One line, whatever bytes the file had that it quotes."""
    return "".join(letter if letter.isprintable() else " " for letter in f"{what}; got {got}; {cure}")
