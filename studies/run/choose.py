"""Training: from blocks to the best setting of every terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Settings
from ...optimise.counts import Corners, Grid, merge
from ...optimise.staircase import Front, merge_fronts
from ...optimise.thresholds import Choice, Sample, choose
from .classes import REPORTED, DrawClass, Purpose
from .draw import BlockId, Case
from .engine import BLOCK
from .ledger import Attempt
from .tally import Trained

__all__ = ["Training", "choices", "gather", "more_blocks", "planned_blocks"]

MERGE_EVERY = 32  #: blocks gathered between merges; bounds memory, changes no result

#: every class that the certificate bounds, and the breaks, need as many trials as asked for
BOUNDED = tuple(r for r, own in enumerate(REPORTED) if own.kind != "apart")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Training:
    """All training blocks together, per terminal."""

    opens: tuple[Corners, ...]
    stiff: tuple[Corners, ...]
    false: tuple[Corners, ...]
    front: tuple[Front, ...]
    trials: NDArray[np.int64]  #: (R, T)
    reachable: NDArray[np.int64]  #: (T,)


def planned_blocks(case: Case, purpose: Purpose, attempt: Attempt) -> list[BlockId]:
    """Blocks that most likely give every class, side and judged terminal its trials."""
    n, blocks = attempt.scenarios, []
    for drawn in DrawClass:
        share = _smallest_share(case, drawn)
        draws = n / share + 4.0 * math.sqrt(n * (1.0 - share)) / share
        blocks += [
            BlockId(
                seed=attempt.seed, purpose=purpose, attempt=attempt.number, drawn=drawn, block=b
            )
            for b in range(math.ceil(draws / BLOCK))
        ]
    return blocks


def more_blocks(case: Case, had: list[BlockId], trials: NDArray[np.int64], n: int) -> list[BlockId]:
    """Further blocks for classes that are still below ``n`` trials at a judged terminal."""
    judged = [t for t, terminal in enumerate(case.points.terminals) if not terminal.load_side]
    blocks = []
    for drawn in DrawClass:
        own = [which for which in had if which.drawn == drawn]
        rows = [r for r in BOUNDED if REPORTED[r].drawn == drawn and trials[r].any()]
        if not own or not rows or not judged:
            continue
        counts = trials[np.ix_(rows, judged)]
        # a class that cannot occur at a terminal has no trials there, however many are drawn
        least = int(counts[counts > 0].min(initial=n))
        if least < n:
            per_block = least / len(own)
            extra = math.ceil(1.2 * (n - least) / per_block)
            blocks += [
                BlockId(
                    seed=own[0].seed,
                    purpose=own[0].purpose,
                    attempt=own[0].attempt,
                    drawn=drawn,
                    block=len(own) + b,
                )
                for b in range(extra)
            ]
    return blocks


def _smallest_share(case: Case, drawn: DrawClass) -> float:
    """The smallest share of draws that any bounded class and judged terminal gets."""
    if drawn in (DrawClass.SOURCE_STEP, DrawClass.OPEN_THREE):
        return 1.0
    length = case.network.length_km
    shares = []
    for terminal in case.points.terminals:
        if terminal.load_side:
            continue
        if drawn == DrawClass.LOAD_STEP:
            inside = 1.0 / len(case.regions)
            shares += [inside, 1.0 - inside]
        else:
            on_path = length[terminal.on_path].sum() / length.sum()
            outside = length[~terminal.in_section].sum() / length.sum()
            shares += [on_path, outside]
    return float(min((share for share in shares if share > 0), default=1.0))


def gather(blocks: Iterable[Trained]) -> Training:
    """Add up blocks; memory does not grow with their number."""
    waiting: list[Trained | Training] = []
    for block in blocks:
        waiting.append(block)
        if len(waiting) > MERGE_EVERY:
            waiting = [_add(waiting)]
    return _add(waiting)


def _add(parts: list[Trained | Training]) -> Training:
    terminals = range(len(parts[0].front))
    return Training(
        opens=tuple(merge([p.opens[t] for p in parts]) for t in terminals),
        stiff=tuple(merge([p.stiff[t] for p in parts]) for t in terminals),
        false=tuple(merge([p.false[t] for p in parts]) for t in terminals),
        front=tuple(merge_fronts([p.front[t] for p in parts]) for t in terminals),
        trials=np.sum([p.trials for p in parts], axis=0),
        reachable=np.sum([p.reachable for p in parts], axis=0),
    )


def choices(case: Case, grid: Grid, training: Training) -> list[tuple[Choice | None, ...]]:
    """Per terminal: the chosen setting and the best at the reference V_set; None: there is none."""
    reference = case.study.reference
    wanted = (reference.i_set_a, reference.v_set_pct / 100.0, reference.z_set_ohm)
    at_reference_v = np.flatnonzero(np.isclose(grid.v_set_pu, wanted[1]))
    found: list[tuple[Choice | None, ...]] = []
    for t, terminal in enumerate(case.points.terminals):
        if terminal.load_side:
            found.append((None, None))
            continue

        def best(only_v: int | None, t: int = t) -> Choice | None:
            sample = Sample(
                opens=training.opens[t],
                stiff=training.stiff[t],
                trials=int(training.reachable[t]),
                front=training.front[t],
            )
            answer = choose(grid, sample, case.study.certificate.margin, wanted, only_v)
            return answer if isinstance(answer, Choice) else None

        found.append((best(None), best(int(at_reference_v[0])) if at_reference_v.size else None))
    return found


def as_settings(case: Case, choice: Choice | None) -> Settings | None:
    """The detector's settings of a choice."""
    if choice is None:
        return None
    return Settings(
        i_set_a=choice.i_set_a,
        v_set_pu=choice.v_set_pu,
        z_set_ohm=choice.z_set_ohm,
        negative_sign=case.study.detector.negative_sign,
    )
