"""What a margin in training is worth in validation: the figures of decision 0005.

Trains on several small samples, chooses at several margins, and counts the false trips of
every choice on one large sample that none of them has seen. About two minutes on two cores.
"""

from __future__ import annotations

import functools
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from openphase.model import load_feeder
from openphase.studies.run.blocks import run_blocks
from openphase.studies.run.certify import add_up
from openphase.studies.run.choose import as_settings, choices, gather, planned_blocks
from openphase.studies.run.classes import REPORTED, Purpose
from openphase.studies.run.draw import make_case
from openphase.studies.run.engine import BLOCK
from openphase.studies.run.ledger import Attempt
from openphase.studies.run.store import RunFolder
from openphase.studies.run.tally import Tested, Trained, judge_block, train_block
from openphase.studies.spec.study_file import default_study

MARGINS = (1.0, 1.05, 1.1, 1.25, 1.5)
SEEDS = range(101, 109)
TRAINING = 8_000
VALIDATION = 40_000


def attempt(seed: int, scenarios: int) -> Attempt:
    """A first attempt, in no ledger."""
    return Attempt(number=1, scenarios=scenarios, feeder="", study="", seed=seed)


def main() -> None:
    """Print, per margin, how often a choice trips falsely and what it finds."""
    study, feeder = default_study("paper"), load_feeder("paper")
    with tempfile.TemporaryDirectory() as scratch:
        ways: list[list[object]] = []
        for seed in SEEDS:
            case = make_case(feeder, study)
            blocks = planned_blocks(case, Purpose.TRAIN, attempt(seed, TRAINING))
            folder = RunFolder(Path(scratch) / str(seed))
            compute = functools.partial(train_block, case)
            trained = run_blocks(compute, Trained, blocks, folder, 2, f"seed {seed}")
            training = gather(block for _, block in trained)
            for margin in MARGINS:
                demand = replace(study.certificate, margin=margin)
                own = make_case(feeder, replace(study, certificate=demand))
                (chosen,) = choices([own], [training])
                ways.append([as_settings(study, one.best) if one else None for one in chosen])
        settings = tuple(zip(*ways, strict=True))
        blocks = planned_blocks(case, Purpose.VALIDATE, attempt(1, VALIDATION))
        compute = functools.partial(judge_block, case, settings=settings)
        tested = run_blocks(compute, Tested, blocks, RunFolder(Path(scratch)), 2, "validation")
        total = add_up(tested, BLOCK)
    must_not = [r for r, own in enumerate(REPORTED) if own.kind == "must_not_trip"]
    judged = np.flatnonzero(case.judged)
    false = total.trips[:, must_not][:, :, judged].sum(axis=1)
    found = total.found[:, judged] / total.reachable[judged]
    shape = (len(SEEDS), len(MARGINS), len(judged))
    print(f"{len(SEEDS)} trainings of n = {TRAINING:,}; validation n = {VALIDATION:,}")
    print(f"{'margin':>7}{'choices without a false trip':>30}{'false trips, mean':>19}{'found':>8}")
    for n, margin in enumerate(MARGINS):
        k = false.reshape(shape)[:, n]
        share = found.reshape(shape)[:, n].mean()
        print(f"{margin:>7}{f'{(k == 0).sum()} of {k.size}':>30}{k.mean():>19.2f}{share:>8.3f}")
    print("trials that must not trip, per terminal:", total.trials[must_not][:, judged].sum(axis=0))


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    main()
