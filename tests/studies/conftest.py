"""Small runs on the paper's feeder that tests of what is shown share; none may change them."""

from dataclasses import replace

import pytest

from openphase.model.reading.feeder_file import load_feeder
from openphase.studies.assessing import assess_feeder
from openphase.studies.run.classes import DrawClass
from openphase.studies.run.session import Demand
from openphase.studies.sizing import size_feeder
from openphase.studies.spec.parts import Group
from openphase.studies.spec.study_file import default_study

GROUPS = (
    Group(name="normal"),
    Group(name="tie closed", closed=("R4",)),
    Group(name="fed backwards", closed=("R4",), opened=("R1",)),
)
#: of every kind: must trip, must not, told apart, with an alarm
FEW = ("open_phase", "load_step", "source_step", "earth_fault", "open_three", "wiring")


def study_of(*, groups=(), drawn=FEW):
    """The paper's study with a few classes of events, for speed."""
    study = default_study("paper")
    without = tuple(own.name.lower() for own in DrawClass if own.name.lower() not in drawn)
    events = replace(study.events, without=without)
    network = replace(study.network, closed=None) if groups else study.network
    return replace(study, events=events, groups=groups, network=network)


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """Where the runs are, under one ledger."""
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="session")
def sizing(runs):
    """Every class of events, one setting group."""
    demand = Demand(scenarios=300, jobs=1)
    return size_feeder(load_feeder("paper"), default_study("paper"), demand, runs / "paper")


@pytest.fixture(scope="session")
def grouped(tmp_path_factory):
    """Three setting groups, of which one is a closed loop that leaves R5-R4b no Z_set."""
    out = tmp_path_factory.mktemp("grouped") / "run"
    demand = Demand(scenarios=60, jobs=1)
    return size_feeder(load_feeder("paper"), study_of(groups=GROUPS), demand, out)


@pytest.fixture(scope="session")
def assessed(runs, sizing):
    """The reference everywhere, on the draws of ``sizing``."""
    demand = Demand(scenarios=300, jobs=1)
    study = default_study("paper")
    return assess_feeder(load_feeder("paper"), study, None, demand, runs / "reference")
