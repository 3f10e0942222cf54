"""Every example runs as it stands, and the short benchmark that docs quote."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPTS = {
    **{path.stem: [str(path)] for path in sorted((ROOT / "examples").glob("*.py"))},
    "learned_part": ["-m", "papers.rope_chains.learned_part"],
}


@pytest.mark.parametrize("script", SCRIPTS)
def test_scripts_run(script, tmp_path):
    done = subprocess.run(
        [sys.executable, *SCRIPTS[script]],
        cwd=tmp_path,
        env=os.environ | {"NUMBA_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout
