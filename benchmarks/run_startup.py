"""Seconds to import the solver and to call it for the first time; prints JSON."""

from __future__ import annotations

import json
import sys
from time import perf_counter

start = perf_counter()
import numba  # noqa: E402, F401

numba_s = perf_counter() - start
from openphase.model import load_feeder  # noqa: E402
from openphase.model.network import compile_network  # noqa: E402
from openphase.model.solve import solve, steady_state  # noqa: E402

network = compile_network(load_feeder("paper"))
start = perf_counter()
solve(network, steady_state(network))
first_s = perf_counter() - start
json.dump({"import_numba_s": numba_s, "first_call_s": first_s}, sys.stdout)
