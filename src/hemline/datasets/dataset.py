"""Datasets: folders of takes of one garment.

```
folder/
  garment.safetensors        the garment, mesh and all
  worn/<hash>.safetensors    the garment that a try-on made of a mesh with this hash, if it had to be tried on
  takes/<hash>.safetensors   takes, each of which describes itself
  manifest.json              an index of the takes with checksums, rebuilt whenever it is missing or stale
  timings.jsonl              a log of the time that each take took, not part of the data
```
Copying the takes of one dataset into another of the same garment merges them. Several processes may add to one dataset:
a take's name is the hash of its inputs, which determine its bytes, so a take that is made twice is there once.
"""

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hemline import bodies
from hemline.errors import BadBody, BadDataset, BadOutput, DamagedTake
from hemline.files import atomic_write
from hemline.garments.garment import Garment

from .aside import put_aside, unreadable
from .row import MANIFEST_VERSION, Row, manifest_rows
from .split import FRACTIONS, Fractions, split_by_subject
from .take import Take, read_take, take_metadata, take_name, write_take
from .take_checks import MAKE_AGAIN
from .take_faults import TakeFaults, take_faults


@dataclass(frozen=True)
class Dataset:
    """Takes of one garment on disk."""

    folder: Path
    garment: Garment
    left_out: frozenset[str] = frozenset()
    """Names of the takes that `clips`, `anchors` and `split` do not return, see `leave_out_faulty`."""

    @cached_property
    def body(self) -> bodies.Body:
        """The body that the garment was made on and simulated on, in its mean shape; read once.

        Raises:
            BadBody: No body of that name ships, or its file cannot be read.
        """
        return bodies.load(self.garment.body_name)

    @property
    def takes_folder(self) -> Path:
        """Folder of the takes."""
        return self.folder / "takes"

    def path(self, name: str) -> Path:
        """Returns the path of the take of that name, which may not exist."""
        return self.takes_folder / f"{name}.safetensors"

    def rows(self) -> list[Row]:
        """Returns the index, updated to the files that exist, sorted by clip, part and name.

        Raises:
            BadDataset: A take cannot be read, or belongs to another garment.
            DamagedTake: A take is damaged; this is a kind of `BadDataset`.
        """
        return self._update_index(lambda file, known: self._row(file, known))

    def put_damaged_aside(self) -> list[Row]:
        """Renames damaged takes, with a warning for each, so that they are made again; returns the index.

        This is called before takes are added, so that damage is not discovered after hours of work.

        Raises:
            BadDataset: A take cannot be read, was written by a newer hemline, or belongs to another garment. It may be
                intact, so it stays as it is.
            BadOutput: A damaged take cannot be renamed.
        """

        def row(file: Path, known: dict[str, Row]) -> Row | None:
            try:
                found = self._row(file, known)
                if found is not None and found is known.get(file.stem):
                    file.open("rb").close()
                return found
            except OSError as reason:
                raise unreadable(file, reason) from reason
            except DamagedTake as reason:
                put_aside(file, reason)
                return None

        return self._update_index(row)

    def clips(self) -> list[Row]:
        """Returns the rows of all takes of clips that did not fail."""
        return self._usable("clip")

    def anchors(self) -> list[Row]:
        """Returns the rows of all anchors that did not fail: the garment settled in given poses on given shapes."""
        return self._usable("anchor")

    def _usable(self, kind: str) -> list[Row]:
        return [row for row in self.rows() if row.kind == kind and row.failed is None and row.name not in self.left_out]

    def take(self, row: Row | str) -> Take:
        """Reads a take by its row or name.

        Raises:
            BadDataset: The take cannot be read, or is of another garment.
            DamagedTake: The take is damaged; this is a kind of `BadDataset`.
        """
        path = self.path(row if isinstance(row, str) else row.name)
        take = read_take(path)
        if take.vertices.shape[1] != len(self.garment.vertices):
            got = f"{take.vertices.shape[1]} vertices for the {len(self.garment.vertices)} of {self.garment.name}"
            raise BadDataset(f"{path} is of another garment", got, MAKE_AGAIN)
        return take

    def find_by_inputs(self, inputs: Mapping[str, Any]) -> Take | None:
        """Returns the take that was made of these inputs, or None if the dataset has none, see `find`.

        Raises:
            BadDataset: The take cannot be read, see `find`, or the file of that name holds another take.
            BadOutput: A damaged take cannot be renamed.
        """
        name = take_name(inputs)
        take = self.find(name)
        if take is not None and take.name != name:
            what = f"{self.path(name)} holds another take than its name says"
            raise BadDataset(what, f"take {take.name}", MAKE_AGAIN)
        return take

    def find(self, name: str) -> Take | None:
        """Returns the take of that name, or None if there is none or it is damaged; a damaged one is renamed.

        Raises:
            BadDataset: The take cannot be read, or was written by a newer hemline; it may be intact.
            BadOutput: A damaged take cannot be renamed.
        """
        path = self.path(name)
        if not os.path.lexists(path):
            return None
        try:
            return self.take(name)
        except DamagedTake as reason:
            put_aside(path, reason)
            return None

    def add(self, take: Take, *, quantised: bool = False) -> Path:
        """Writes a take under its name, whole or not at all, and returns its path."""
        path = self.path(take.name)
        write_take(path, take, quantised=quantised)
        return path

    def rest(self, betas: Iterable[float] = ()) -> Take:
        """Returns the settled drape on the body with these betas in its rest pose, made by the newest simulator.

        Raises:
            BadDataset: The dataset has none for these betas.
        """
        wanted = np.trim_zeros(np.asarray(list(betas), np.float32), "b")
        rows = self.rest_rows(wanted)
        if not rows:
            raise BadDataset(
                f"{self.folder} holds no rest state for these betas",
                wanted.tolist(),
                "run 'hemline simulate' with these betas",
            )
        return self.take(rows[-1])

    def rest_rows(self, betas: Iterable[float]) -> list[Row]:
        """Returns the rows of settled drapes on the body with these betas in its rest pose, sorted by simulator."""
        wanted = np.trim_zeros(np.asarray(list(betas), np.float32), "b")
        found = [
            row
            for row in self.rows()
            if row.kind == "rest" and np.array_equal(np.trim_zeros(np.asarray(row.betas, np.float32), "b"), wanted)
        ]
        return sorted(found, key=lambda row: row.simulator)

    def split(self, which: str, *, fractions: Fractions = FRACTIONS) -> list[Row]:
        """Returns the rows of `train`, `val` or `test`: split by subject, so that no recording is on two sides."""
        return split_by_subject(self.clips(), fractions)[which]

    def verify(self) -> None:
        """Compares each file with its checksum.

        Raises:
            BadDataset: A file's content changed since it was indexed.
        """
        for row in self.rows():
            if _sha256(self.path(row.name)) != row.sha256:
                raise BadDataset(
                    f"take {row.name} does not match its checksum",
                    "other bytes",
                    MAKE_AGAIN,
                )

    def log_timing(self, entry: dict[str, Any]) -> None:
        """Adds a line to `timings.jsonl`, whole even if several processes write; on a full disk it is dropped."""
        line = json.dumps(entry, sort_keys=True) + "\n"
        with suppress(OSError), (self.folder / "timings.jsonl").open("ab", buffering=0) as stream:
            stream.write(line.encode())

    def _update_index(self, row_of: Callable[[Path, dict[str, Row]], Row | None]) -> list[Row]:
        """Returns the rows of all takes, and writes the index if they have changed."""
        known = {row.name: row for row in manifest_rows(self.folder / "manifest.json")}
        found = [row_of(file, known) for file in self._files()]
        rows = sorted((row for row in found if row), key=lambda row: (row.kind, row.clip, row.part, row.name))
        if {row.name: row for row in rows} != known:
            self._write_manifest(rows)
        return rows

    def _files(self) -> list[Path]:
        """The files of takes, by name; those whose name begins with a dot are not whole yet."""
        try:
            names = os.listdir(self.takes_folder)
        except FileNotFoundError:
            return []
        except OSError as reason:
            raise unreadable(self.takes_folder, reason) from reason
        whole = (name for name in names if name.endswith(".safetensors") and not name.startswith("."))
        return [self.takes_folder / name for name in sorted(whole)]

    def _row(self, file: Path, known: dict[str, Row]) -> Row | None:
        """Returns the row of a file; None if the file was moved away just now, as by another process."""
        try:
            stat = file.stat()
        except OSError as reason:
            if not os.path.lexists(file):
                return None
            raise unreadable(file, reason) from reason
        old = known.get(file.stem)
        if old and (old.bytes, old.stamp) == (stat.st_size, stat.st_mtime_ns):
            return old
        metadata = take_metadata(file)
        inputs = metadata["inputs"]
        if inputs.get("garment") != self.garment.hash:
            raise BadDataset(
                f"take {file.name} was made for another garment",
                f"garment hash {inputs.get('garment')}",
                f"keep it in a dataset of its own; this one holds {self.garment.name} ({self.garment.hash})",
            )
        take = self.take(file.stem)
        faults = TakeFaults({}, 1.0) if take.kind == "rest" else take_faults(take, self.garment, self._body_of(take))
        return Row(
            name=file.stem,
            kind=take.kind,
            clip=str(inputs.get("clip", "")),
            subject=str(inputs.get("subject", "")),
            part=inputs.get("part", 0),
            frames=len(take.motion),
            clip_frames=len(take.clip_frames),
            betas=tuple(float(b) for b in take.betas),
            failed=take.failed,
            figures=dict(take.figures),
            sha256=_sha256(file),
            bytes=stat.st_size,
            stamp=stat.st_mtime_ns,
            simulator=take.simulator,
            limbs_through=faults.limbs_through,
            edge_ratio=faults.edge_ratio,
        )

    def _body_of(self, take: Take) -> bodies.ShapedBody | None:
        """Returns the body of a take; None if its file is not here."""
        try:
            return self.body.shaped(take.betas)
        except BadBody:
            return None

    def _write_manifest(self, rows: list[Row]) -> None:
        content = {"version": MANIFEST_VERSION, "garment": self.garment.hash, "takes": [asdict(row) for row in rows]}
        try:
            with atomic_write(self.folder / "manifest.json") as temporary:
                temporary.write_text(json.dumps(content, indent=1, sort_keys=True))
        except BadOutput:
            return  # the index is a mere convenience; a dataset on a read-only disk stays readable


def create(folder: str | Path, garment: Garment) -> Dataset:
    """Creates a dataset for a garment, or opens an existing one of the same garment.

    Raises:
        BadDataset: The folder has a dataset of another garment.
        BadOutput: The folder cannot be written.
    """
    folder = Path(folder)
    if not (folder / "garment.safetensors").exists():
        try:
            (folder / "takes").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadOutput(
                f"cannot make {folder}", error.strerror or error, "name a folder that can be written"
            ) from error
        _save_first(folder, garment)
    found = open_dataset(folder)
    if found.garment.hash != garment.hash:
        raise BadDataset(
            f"{folder} was made for another garment",
            f"{found.garment.name} ({found.garment.hash})",
            f"choose another folder for {garment.name} ({garment.hash})",
        )
    return found


def _save_first(folder: Path, garment: Garment) -> None:
    """Saves the garment unless another process was faster: of two that create a dataset at once, one wins."""
    own = folder / f".garment-{garment.hash}-{os.getpid()}.safetensors"
    garment.save(own)
    try:
        os.link(own, folder / "garment.safetensors")
    except FileExistsError:
        pass
    except OSError:
        own.replace(folder / "garment.safetensors")  # a disk without links
    finally:
        own.unlink(missing_ok=True)


def open_dataset(folder: str | Path) -> Dataset:
    """Opens a dataset.

    Raises:
        BadDataset: The folder is not a dataset, or its garment is damaged.
    """
    folder = Path(folder)
    file = folder / "garment.safetensors"
    if not file.is_file():
        raise BadDataset(f"{folder} is no dataset", "no garment.safetensors in it", "make one with 'hemline simulate'")
    return Dataset(folder, Garment.load(file))


def _sha256(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as reason:
        raise unreadable(file, reason) from reason
