"""What a full disk does to a command: one line, status 2, nothing half-written, no hanging."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from processes import PATIENCE, process

from flexsim import model_path

MOST = 1000  # [bytes] that a file may have: a limit stands in for the end of the disk
LIMITED = f"""
import os, resource, shutil, sys
from studies.main import main
here = os.getcwd()
os.chdir(shutil.copytree(".", sys.argv.pop(1)))
assert main(sys.argv[1:]) == 0  # all is compiled, and what is compiled is kept
os.chdir(here)
resource.setrlimit(resource.RLIMIT_FSIZE, ({MOST}, {MOST}))
sys.exit(main())
"""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("chain --out chain.xml", "chain.xml: cannot write the file: File too large"),
        ("drive --torque tau.csv --out o.csv", "o.csv: cannot write the motion: File too large"),
        pytest.param(
            "watch my.xml --once --rrd run.rrd",
            "run.rrd: cannot write the recording: File too large",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "tune --plant rigid --population 4 --survivors 2 --generations 2 --trajectory circle "
            "--out new/run",
            "File too large",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_one_line_and_nothing_left(
    words: str, said: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    (tmp_path / "my.xml").write_text(model_path("chain6.xml").read_text())
    rows = [f"{k * 1e-3:.3f},0,0" for k in range(200)]
    (tmp_path / "tau.csv").write_text("\n".join(["t,tau1,tau2", *rows, ""]))
    roomy = str(tmp_path_factory.mktemp("roomy") / "copy")
    limited = [sys.executable, "-c", LIMITED, roomy, *words.split()]
    with process(limited, cwd=tmp_path) as started:
        _, err = started.communicate(timeout=PATIENCE)
        assert started.returncode == 2, err
    assert err.startswith("flexsim: ") and said in err and err.count("\n") == 1
    assert "/.flexsim-" not in err  # where it was being written is nobody's business
    assert {path.name for path in tmp_path.iterdir()} == {"my.xml", "tau.csv"}
