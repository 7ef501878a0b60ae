"""MuJoCo judges: some runs of each closed-form cell are run by MuJoCo itself.

>>> check_rows(cells, workshop)[0].check.check_inside
True
"""

from __future__ import annotations

import numpy as np

from studies.core.evidence.check_sample import check_sample
from studies.run.batches import carried_out, prepared
from studies.run.report import CheckRow
from studies.run.summary import Cells
from studies.spec.building import Workshop

CLOSED, MUJOCO = "closed-chain", "chain"


def check_rows(cells: Cells, workshop: Workshop, threads: int | None = None) -> list[CheckRow]:
    """Return what MuJoCo says of each cell of a chain in closed form, if the study asks for it."""
    wanted, matrix = workshop.study.check, workshop.matrix
    if wanted == 0:
        return []
    rows = []
    envelopes = cells.column("envelope")
    for cell, repeats in enumerate(envelopes):
        plant = matrix.cell(cell)[0]
        model = workshop.study.plants[plant].model
        if not model.startswith(CLOSED):
            continue
        runs = np.flatnonzero(cells.of == cell)[:wanted]
        batch = prepared(workshop, runs, model=model.replace(CLOSED, MUJOCO))
        own = carried_out(workshop, batch, threads).column("envelope").to_numpy()
        rows.append(CheckRow(**cells.about(cell), check=check_sample(repeats, list(own))))
    return rows
