"""The number of the simulator: a change of the source that decides the bits of a take asks whether to raise it.

Bits themselves cannot be checked: another processor rounds differently. A scene within a tolerance does not help
either, since a change in the last place makes takes differ, too. So the test compares the source, without comments,
docstrings and blanks.
"""

import ast
import hashlib
import io
import tokenize
from pathlib import Path

import hemline
from hemline.sim import SIMULATOR

PACKAGE = Path(hemline.__file__).parent
DECIDES = (
    "sim/settings.py",
    "sim/cloth",
    "sim/solver",
    "sim/contact",
    "sim/step",
    "sim/rest",
    "sim/takes/simulate.py",
    "sim/takes/setup.py",
    "collide/projection",
    "collide/surface",
    "collide/winding",
    "bodies/lead_in.py",
    "bodies/skinning.py",
    "bodies/skinning_kernels.py",
    "bodies/dual_quaternion_kernels.py",
    "bodies/pose_offsets.py",
    "garments/pins.py",
    "motions/quaternions.py",
)
"""Files and folders of which each line may decide a bit. The placement and untangling of a clip do, too, but they show
in the hash of the motion, which is an input of a take."""

RECORDED = (1, "2f1344ac33c19238")
"""The number, and the hash of the source that it stands for."""


def source_tokens(text: str) -> str:
    """Returns a source without comments, docstrings and blanks; the same on each version of Python."""
    lines = text.splitlines(keepends=True)
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            (row, first), (_, last) = token.start, token.end
            lines[row - 1] = lines[row - 1][:first] + " " * (last - first) + lines[row - 1][last:]
    for node in ast.walk(ast.parse(text)):
        for statement in getattr(node, "body", []) if isinstance(getattr(node, "body", []), list) else []:
            # an expression that is text and stands alone: a docstring, or what is said of an attribute
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                for row in range(statement.lineno, (statement.end_lineno or 0) + 1):
                    lines[row - 1] = ""
    return "".join("".join(lines).split())


def source_hash() -> str:
    """Returns the hash of all source that decides bits."""
    digest = hashlib.sha256()
    for name in DECIDES:
        place = PACKAGE / name
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(f"{file.relative_to(PACKAGE).as_posix()}\n{source_tokens(file.read_text())}\n".encode())
    return digest.hexdigest()[:16]


def test_a_change_of_what_decides_the_bits_asks_for_the_number():
    assert (SIMULATOR, source_hash()) == RECORDED, (
        "the source of the simulator changed: where a take may come out with other bits, raise SIMULATOR in "
        f"sim/settings.py; then record ({SIMULATOR} or the new number, '{source_hash()}') in this test"
    )


def test_what_says_nothing_to_the_machine_is_left_out():
    one = '"""Page."""\nx = 1  # one\n"""Of x."""\n\n\ndef f(a):\n    """Says."""\n    return "# no comment" + a\n'
    other = "x=1\ndef f(a):\n  return '# no comment' + a\n".replace("'", '"')
    assert source_tokens(one) == source_tokens(other)
    assert source_tokens(one) != source_tokens(one.replace("1", "2"))
    assert source_tokens(one) != source_tokens(one.replace("# no", "# a"))
