"""What is kept on disk is compiled anew after a change of anything compiled into it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from friction_bayes.core import kernels

SOURCES = {
    "__init__.py": "",
    "constant.py": "FACTOR = 2.0\n",
    "inner.py": """
from friction_bayes.constant import FACTOR
from friction_bayes.core.kernels import INNER, njit

@njit(**INNER)
def inner(x):
    return FACTOR * x + 1.0
""",
    "outer.py": """
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.inner import inner

@njit(**KERNEL)
def outer(x):
    return inner(x)

print(outer(1.0), len(outer.stats.cache_hits))
""",
}


def test_a_kernel_knows_what_is_compiled_into_it(tmp_path: Path) -> None:
    package = tmp_path / "friction_bayes"
    (package / "core").mkdir(parents=True)
    shutil.copy(kernels.__file__, package / "core")
    for name, source in SOURCES.items():
        (package / name).write_text(source)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}

    def run() -> str:
        command = [sys.executable, "-m", "friction_bayes.outer"]
        return subprocess.run(
            command, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True
        ).stdout.strip()

    assert run() == "3.0 0"
    assert run() == "3.0 1"
    # one after the other: each is a change of what was compiled last
    for changed, old, new, printed in (
        ("constant.py", "2.0", "3.0", "4.0 0"),
        ("inner.py", "+ 1.0", "+ 5.0", "8.0 0"),
    ):
        (package / changed).write_text(SOURCES[changed].replace(old, new))
        assert run() == printed
