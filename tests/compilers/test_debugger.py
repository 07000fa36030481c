"""A debugger stops in a kernel: the session of docs/compilers.md, word for word."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import physics

ROOT = Path(physics.__file__).parents[1]
PAGE = ROOT / "docs" / "compilers.md"


@pytest.mark.skipif(shutil.which("bash") is None, reason="the session is one of a shell")
def test_the_session_of_the_page_goes_as_it_says(tmp_path):
    command, output = re.search(r"```bash\n(.*?pdb.*?)```\s+```text\n(.*?)```", PAGE.read_text("utf-8"), re.S).groups()
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=True, timeout=300,
        env={**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.stdout.splitlines() == output.splitlines()
