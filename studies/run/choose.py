"""Training: from blocks to the best setting of every terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Settings
from ...optimise.counts import Corners, merge
from ...optimise.staircase import Front, merge_fronts
from ...optimise.thresholds import Choice, Refusal, Sample, choose, pool
from ..spec.study_file import Study
from .cases import Case
from .classes import REPORTED, DrawClass, Purpose
from .draw import BlockId, whole_rounds
from .draw_event import draw_event, event_sides, possible_rows
from .engine import BLOCK
from .ledger import Attempt
from .status import common_window
from .tally import Trained

__all__ = [
    "Chosen",
    "Training",
    "as_settings",
    "choices",
    "gather",
    "more_blocks",
    "one_for_all",
    "planned_blocks",
    "reference_settings",
]

MERGE_EVERY = 32  #: blocks gathered between merges; bounds memory, changes no result

MOST_TIMES = 4  #: the planned blocks of a class, where a side of it proves rare
PILOT = 4000  #: events drawn, and not solved, to see how often each class and side comes up

#: every class that the certificate bounds, and the breaks, need as many trials as asked for
BOUNDED = tuple(r for r, own in enumerate(REPORTED) if own.kind != "apart")


# ---- how much to draw ----


def planned_blocks(case: Case, purpose: Purpose, attempt: Attempt) -> list[BlockId]:
    """Blocks that most likely give every class, side and judged terminal its trials."""
    n, blocks = attempt.scenarios, []
    for drawn in case.drawn:
        if purpose == Purpose.TRAIN and not any(REPORTED[r].drawn == drawn for r in BOUNDED):
            continue  # told apart wherever it stands: no setting depends on it
        share = _smallest_share(case, drawn)
        draws = n / share + 4.0 * math.sqrt(n * (1.0 - share)) / share
        count = whole_rounds(case, drawn, math.ceil(draws / BLOCK))
        blocks += _blocks(case, purpose, attempt, drawn, range(count))
    return blocks


def more_blocks(
    case: Case, had: list[BlockId], trials: NDArray[np.int64], attempt: Attempt
) -> list[BlockId]:
    """Further blocks for classes that are still short of trials at a judged terminal.

    Never more than ``MOST_TIMES`` the plan: what is rarer than that stays short, and shows it
    in its bound.
    """
    n, blocks = attempt.scenarios, []
    possible = possible_rows(case)
    planned = planned_blocks(case, had[0].purpose, attempt) if had else []
    for drawn in case.drawn:
        own = [which for which in had if which.drawn == drawn]
        rows = [r for r in BOUNDED if REPORTED[r].drawn == drawn]
        wanted = possible[rows] & case.judged
        if not own or not wanted.any():
            continue
        least = int(trials[rows][wanted].min(initial=n))
        most = MOST_TIMES * sum(which.drawn == drawn for which in planned)
        if least < n and len(own) < most:
            extra = math.ceil(1.2 * (n - least) * len(own) / max(least, 1))
            stop = whole_rounds(case, drawn, min(len(own) + extra, most))
            blocks += _blocks(case, own[0].purpose, attempt, drawn, range(len(own), stop))
    return blocks


def _blocks(
    case: Case, purpose: Purpose, attempt: Attempt, drawn: DrawClass, numbers: range
) -> list[BlockId]:
    return [
        BlockId(
            seed=attempt.seed,
            purpose=purpose,
            attempt=attempt.number,
            group=case.group.index,
            drawn=drawn,
            block=block,
        )
        for block in numbers
    ]


def _smallest_share(case: Case, drawn: DrawClass) -> float:
    """The smallest share of draws that any bounded class and judged terminal gets.

    Seen in a pilot of its own, which no result depends on; what is rarer than one in the
    pilot is left to `more_blocks`. A class that is told apart gets what is asked for in all.
    """
    rows = [REPORTED[r] for r in BOUNDED if REPORTED[r].drawn == drawn]
    if not rows:
        return 1.0
    rng = np.random.Generator(np.random.SFC64(np.random.SeedSequence(0, spawn_key=(int(drawn),))))
    side = event_sides(case, draw_event(rng, case, drawn, PILOT))[case.judged]
    shares = np.array([np.isin(side, own.where).mean(axis=1) for own in rows])
    return float(min(shares[shares > 0], default=1.0))


# ---- adding up blocks ----


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Training:
    """All training blocks of one group together, per terminal."""

    opens: tuple[Corners, ...]
    stiff: tuple[Corners, ...]
    false: tuple[Corners, ...]
    front: tuple[Front, ...]
    trials: NDArray[np.int64]  #: (R, T)
    reachable: NDArray[np.int64]  #: (T,)
    flags: NDArray[np.int64]  #: (4,) scenarios by ``tally.FLAGGED``


def gather(blocks: Iterable[Trained]) -> Training:
    """Add up blocks; memory does not grow with their number."""
    waiting: list[Trained | Training] = []
    for block in blocks:
        waiting.append(block)
        if len(waiting) > MERGE_EVERY:
            waiting = [_add(waiting)]
    return _add(waiting)


def _add(parts: Sequence[Trained | Training]) -> Training:
    terminals = range(len(parts[0].front))
    return Training(
        opens=tuple(merge([p.opens[t] for p in parts]) for t in terminals),
        stiff=tuple(merge([p.stiff[t] for p in parts]) for t in terminals),
        false=tuple(merge([p.false[t] for p in parts]) for t in terminals),
        front=tuple(merge_fronts([p.front[t] for p in parts]) for t in terminals),
        trials=np.sum([p.trials for p in parts], axis=0),
        reachable=np.sum([p.reachable for p in parts], axis=0),
        flags=np.sum([p.flags for p in parts], axis=0),
    )


# ---- choosing ----


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chosen:
    """What training found for one terminal in one group."""

    best: Choice | Refusal
    at_reference_v: Choice | Refusal | None  #: None: the device has no such V_set
    front: Front  #: of the events the choice keeps its margin to
    groups: tuple[Case, ...]  #: in which it is to serve


def one_for_all(cases: Sequence[Case]) -> bool:
    """Whether one setting of a terminal serves all groups."""
    return cases[0].study.network.settings == "one"


def choices(cases: Sequence[Case], trainings: Sequence[Training]) -> list[list[Chosen | None]]:
    """Per group and terminal the best settings; None where the terminal is not judged."""
    if not one_for_all(cases):
        return [
            [
                _choose([case], [training], t) if judged else None
                for t, judged in enumerate(case.judged)
            ]
            for case, training in zip(cases, trainings, strict=True)
        ]
    common = [
        _choose(cases, trainings, t) if any(case.judged[t] for case in cases) else None
        for t in range(len(cases[0].points.terminals))
    ]
    return [
        [own if judged else None for own, judged in zip(common, case.judged, strict=True)]
        for case in cases
    ]


def _choose(cases: Sequence[Case], trainings: Sequence[Training], t: int) -> Chosen:
    """The best setting of terminal ``t`` for all of these groups together."""
    sample = pool([_sample(*pair, t) for pair in zip(cases, trainings, strict=True)])
    window = common_window(cases, t)
    study, grid = cases[0].study, cases[0].grid
    reference = reference_settings(study)
    wanted = (reference.i_set_a, reference.v_set_pu, reference.z_set_ohm)
    margin = study.certificate.margin
    same_v = np.flatnonzero(np.isclose(grid.v_set_pu, reference.v_set_pu))
    return Chosen(
        best=choose(grid, sample, margin, wanted, window=window),
        at_reference_v=choose(grid, sample, margin, wanted, int(same_v[0]), window)
        if same_v.size
        else None,
        front=sample.front,
        groups=tuple(cases),
    )


def _sample(case: Case, training: Training, t: int) -> Sample:
    # on the load side a relay with one setting for all groups may trip falsely, and finds nothing
    blind = case.points.terminals[t].load_side
    return Sample(
        opens=training.opens[t],
        stiff=training.stiff[t],
        trials=0 if blind else int(training.reachable[t]),
        front=training.front[t],
    )


def as_settings(study: Study, choice: Choice | Refusal | None) -> Settings | None:
    """The detector's settings of a choice; None where there is none."""
    if not isinstance(choice, Choice):
        return None
    return Settings(
        i_set_a=choice.i_set_a,
        v_set_pu=choice.v_set_pu,
        z_set_ohm=choice.z_set_ohm,
        options=study.detector.options(),
    )


def reference_settings(study: Study) -> Settings:
    """The study's reference as the detector's settings."""
    return Settings(
        i_set_a=study.reference.i_set_a,
        v_set_pu=float(Fraction(str(study.reference.v_set_pct)) / 100),
        z_set_ohm=study.reference.z_set_ohm,
        options=study.detector.options(),
    )
