"""One run of the engine in a process of its own: the study's mix of classes, block after block.

Prints JSON: seconds in all and by part, scenarios, passes, peak memory. What runs is the
product's own code; the stopwatch is hung in where it calls the noise and the solver.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter
from types import ModuleType
from typing import Any

import numpy as np
from problem import paper_case

from openphase.detector.criteria import Reason, verdict
from openphase.model.states import Answer
from openphase.studies.run import draw, engine
from openphase.studies.run.choose import planned_blocks, reference_settings
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.ledger import Attempt

TRIALS = 57_700  #: per class, as the certificate plans them; they give the mix its proportions
SEED = 1


class Stopwatch:
    """Time by part: always exactly one part runs, so the parts add up to the whole."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.passes: Counter[str] = Counter()
        self._part, self._since = "loop", perf_counter()

    def turn_to(self, part: str) -> str:
        """Let ``part`` run from now on; returns the part that ran."""
        now = perf_counter()
        self.seconds[self._part] += now - self._since
        left, self._part, self._since = self._part, part, now
        return left

    @contextmanager
    def inside(
        self, module: ModuleType, name: str, part_of: Callable[[tuple[Any, ...]], str]
    ) -> Iterator[None]:
        """Count every call of ``module.name`` as the part that ``part_of`` names by its arguments.

        Passes are summed over whole blocks only, not over what helps to start one.
        """
        function = getattr(module, name)

        def timed(*args: Any, **named: Any) -> Any:
            own = part_of(args)
            around = self.turn_to(own)
            result = function(*args, **named)
            self.turn_to(around)
            if isinstance(result, Answer) and result.passes.size == engine.BLOCK:
                self.passes[own] += int(result.passes.sum())
            return result

        setattr(module, name, timed)
        try:
            yield
        finally:
            setattr(module, name, function)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("loads", choices=["constant", "sampled"])
    parser.add_argument("scenarios", type=int)
    asked = parser.parse_args()
    case = paper_case(sampled=asked.loads == "sampled")
    _run(case, [_block_id(drawn, 0, Purpose.TRAIN) for drawn in case.drawn])  # compiles
    json.dump(_run(case, _mix(case, asked.scenarios)), sys.stdout)


def _run(case: draw.Case, mix: list[draw.BlockId]) -> dict[str, Any]:
    count = len(mix) * engine.BLOCK
    watch = Stopwatch()
    trips = 0
    settings = reference_settings(case.study)
    with (
        watch.inside(draw, "draw_errors", lambda _: "noise"),
        watch.inside(engine, "solve", lambda _: "solve before"),
        watch.inside(engine, "solve_after", lambda _: "solve after"),
    ):
        start = perf_counter()
        for which in mix:
            watch.turn_to("draw")
            scenarios = draw.draw_scenarios(case, which, engine.BLOCK)
            watch.turn_to("measure + evidence")
            seen = engine.observe(case, scenarios, settings.options)
            watch.turn_to("verdict")
            trips += int((verdict(seen.evidence, settings) == Reason.TRIP).sum())
        watch.turn_to("loop")
        total = perf_counter() - start
    return {
        "scenarios": count,
        "blocks": dict(Counter(which.drawn.name.lower() for which in mix)),
        "seconds": total,
        "parts": {name: spent for name, spent in watch.seconds.items() if name != "loop"},
        "passes": {name: passes / count for name, passes in watch.passes.items()},
        "trips": trips,
        "peak_mb": _peak_mb(),
    }


def _mix(case: draw.Case, scenarios: int) -> list[draw.BlockId]:
    """Blocks of every class in the study's proportions, class after class."""
    attempt = Attempt(number=1, scenarios=TRIALS, feeder="", study="", seed=SEED)
    planned = Counter(b.drawn for b in planned_blocks(case, Purpose.VALIDATE, attempt))
    share = scenarios / engine.BLOCK / planned.total()
    stops = np.rint(share * np.cumsum(list(planned.values()))).astype(int)
    counts = np.maximum(np.diff(stops, prepend=0), 1)
    return [
        _block_id(drawn, block, Purpose.VALIDATE)
        for drawn, count in zip(planned, counts.tolist(), strict=True)
        for block in range(count)
    ]


def _block_id(drawn: DrawClass, block: int, purpose: Purpose) -> draw.BlockId:
    return draw.BlockId(seed=SEED, purpose=purpose, attempt=1, drawn=drawn, block=block)


def _peak_mb() -> float:
    """The most memory that this process has held."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


if __name__ == "__main__":
    main()
