"""The example of a query gives what the motions have."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
from processes import ROOT
from recorded_cases import made_up_cases

from flexsim import Parameters
from flexsim.recording.rrd import write_recording

SINGLE = 1e-6  # relative, of 32-bit numbers


@pytest.mark.parametrize("number", [0, 1])
def test_a_recording_is_asked(number: int, tmp_path: Path) -> None:
    """Also where one plant diverged, and has fewer samples."""
    case = made_up_cases()[number]
    write_recording(tmp_path / "run.rrd", [case], {}, Parameters())
    asked = runpy.run_path(str(ROOT / "examples" / "query.py"))["apart"]
    found = asked(tmp_path / "run.rrd", case.name)
    modes, chain = case.motions.values()
    k = min(len(modes.time), len(chain.time))
    distance = 1e3 * np.linalg.norm(chain.tip[:k] - modes.tip[:k], axis=1)
    at = int(np.argmax(distance))
    assert found["at_s"] == pytest.approx(modes.time[at])
    assert found["apart_mm"] == pytest.approx(distance[at], rel=SINGLE)
    assert found["torque_1_Nm"] == pytest.approx(chain.torque[at, 0], rel=SINGLE)
    assert found["rms_mm"] == pytest.approx(np.sqrt(np.mean(distance**2)), rel=SINGLE)
