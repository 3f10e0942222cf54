"""Kernels have one form: few arguments, one contract, and stores that a parallel compiler cannot mistake for dead."""

import ast

import pytest

from tests.promises.import_graph import PACKAGE

MOST_ARGUMENTS = 8
TYPING = "typing"
"""First argument of an intrinsic, which numba itself passes."""
KERNELS = [
    (file, node)
    for file in sorted(PACKAGE.rglob("*kernels.py"))
    for node in ast.walk(ast.parse(file.read_text()))
    if isinstance(node, ast.FunctionDef)
    and any(word in ast.unparse(each) for each in node.decorator_list for word in ("kernel", "intrinsic"))
]
"""Each compiled function, with its file."""


def place(file, node) -> str:
    return f"{file.relative_to(PACKAGE)}:{node.lineno} {node.name}"


def arguments(node) -> list[str]:
    return [each.arg for each in node.args.args if each.arg != TYPING]


def test_kernels_take_few_arguments():
    assert len(KERNELS) > 300
    many = [place(*each) for each in KERNELS if len(arguments(each[1])) > MOST_ARGUMENTS]
    assert not many, f"pass named tuples that stand for things to {many}"


@pytest.mark.parametrize("word", ["Reads: ", "Writes: "])
def test_kernels_say_what_they_read_and_write(word):
    silent = []
    for file, node in KERNELS:
        names = arguments(node)
        asked = names if word == "Reads: " else [each for each in names if each.endswith("_out") or each == "out"]
        if asked and word not in (ast.get_docstring(node) or ""):
            silent.append(place(file, node))
    assert not silent, (
        f"the docstring of a kernel has lines Reads:, Writes: and Returns:, with shapes and units: {silent}"
    )


def unsafe_stores(node: ast.FunctionDef) -> set[str]:
    """Arrays of named tuples that a parallel kernel stores to in a way that numba 0.6x may remove as dead code.

    Its analysis of aliases follows `energy_out = out.energy` before the loop. It does not follow
    `energy_out, residual_out = out`, nor `out.energy[i] = value` in the loop.
    """
    arguments, unpacked, found = {each.arg for each in node.args.args}, set(), set()
    for each in ast.walk(node):
        if isinstance(each, ast.Assign):
            for target in each.targets:
                pairs = [(target, each.value)]
                if isinstance(target, ast.Tuple) and isinstance(each.value, ast.Tuple):
                    pairs = list(zip(target.elts, each.value.elts, strict=True))
                for one, value in pairs:
                    if isinstance(one, ast.Tuple) and isinstance(value, ast.Name) and value.id in arguments:
                        unpacked |= {name.id for name in one.elts if isinstance(name, ast.Name)}
    for each in ast.walk(node):
        if isinstance(each, ast.Subscript) and isinstance(each.ctx, ast.Store):
            named = isinstance(each.value, ast.Name) and each.value.id in unpacked
            if named or isinstance(each.value, ast.Attribute):
                found.add(ast.unparse(each.value))
    return found


def test_parallel_kernels_store_to_arrays_that_were_named_before_the_loop():
    bad = {}
    for file, node in KERNELS:
        if "parallel=True" in "".join(map(ast.unparse, node.decorator_list)) and (found := unsafe_stores(node)):
            bad[place(file, node)] = found
    assert not bad, f"write `array_out = out.array` before the loop and store to array_out: {bad}"
