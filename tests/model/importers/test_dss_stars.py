"""Loads about a neutral that nothing earths, against OpenDSS's own solution."""

from __future__ import annotations

from pathlib import Path

import pytest
from dss_circuits import script

from openphase.model.errors import InputError
from openphase.model.importers.dss_feeder import Imported, import_opendss
from openphase.model.importers.fidelity import differences

pytestmark = pytest.mark.usefixtures("engine")

LINE = "new line.l1 bus1=m bus2=b linecode=oh length=2 units=mi"
STAR = "bus1=b.1.2.3.4 phases=3 kv=12.47 kw=900 kvar=300"
LIMITS = "vminpu=0.9 vmaxpu=1.1 vlowpu=0.5"
NEUTRAL = 1e-5  #: OpenDSS holds a free neutral by a millionth of what joins it
BROKEN = ("", "open line.l1 2 1", "open line.l1 1 2")
MODELS = {
    "power": "model=1",
    "q impedance": "model=3",
    "exponents": "model=4 cvrwatts=0.8 cvrvars=3",
    "current": "model=5",
    "shares": "model=8 zipv=(0.3 0.3 0.4 0.2 0.5 0.3 0)",
}


@pytest.fixture
def engine() -> None:
    pytest.importorskip("dss", reason="needs the extra: pip install 'openphase[opendss]'")


def imported(folder: Path, *commands: str) -> Imported:
    path = folder / "star.dss"
    path.write_text(script((LINE, *filter(None, commands))), encoding="utf-8")
    return import_opendss(path)


def largest(found: Imported) -> float:
    rows = differences(found)
    assert all(row.converged and row.opendss_converged for row in rows)
    return max(row.largest_pu for row in rows)


def told(found: Imported) -> dict[str, tuple[str, str]]:
    """Fate and how of the star's loads."""
    rows = found.findings.rows
    return {r.name: (r.fate, r.how) for r in rows if r.kind == "load" and r.name[0] == "x"}


@pytest.mark.parametrize("broken", BROKEN)
def test_a_star_of_impedances_is_exactly_its_delta(broken: str, tmp_path: Path) -> None:
    found = imported(tmp_path, f"new load.x {STAR} model=2", broken)
    (load,) = (load for load in found.feeder.loads if load.name == "x")
    assert (load.connection, load.phases, load.kw) == ("delta", "abc", pytest.approx(900.0))
    assert told(found)["x"][0] == "as it is"
    assert largest(found) < NEUTRAL


@pytest.mark.parametrize("broken", BROKEN)
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_a_star_of_any_law_is_near_its_delta(model: str, broken: str, tmp_path: Path) -> None:
    """Taken as earthed it is up to half of the voltage off after a break."""
    found = imported(tmp_path, f"new load.x {STAR} {model} {LIMITS}", broken)
    fate, how = told(found)["x"]
    assert fate == "approximated"
    assert "exact for constant impedances" in how
    assert largest(found) < 5e-3
    earthed = f"new load.x {STAR.replace('.4', '.0')} {model} {LIMITS}"
    if broken:
        assert not found.findings.of("not fed")
        assert abs(_v_open(found) - _v_open(imported(tmp_path, earthed, broken))) > 0.2


def _v_open(found: Imported) -> float:
    return differences(found)[0].lowest_pu


@pytest.mark.parametrize("model", [*MODELS.values(), "model=2"])
@pytest.mark.parametrize("broken", BROKEN)
def test_two_equal_branches_are_one_between_the_phases(
    model: str, broken: str, tmp_path: Path
) -> None:
    found = imported(
        tmp_path, f"new load.x bus1=b.1.3.4 phases=2 kv=12.47 kw=600 kvar=200 {model}", broken
    )
    (load,) = (load for load in found.feeder.loads if load.name == "x")
    assert (load.connection, load.phases, load.kw) == ("delta", "ac", pytest.approx(600.0))
    assert told(found)["x"][0] == "as it is"
    assert largest(found) < NEUTRAL


@pytest.mark.parametrize("broken", BROKEN)
def test_unequal_impedances_that_meet_at_a_neutral_are_their_mesh(
    broken: str, tmp_path: Path
) -> None:
    loads = [
        f"new load.x{n} bus1=b.{n}.4 phases=1 kv=7.2 kw={100 * n} kvar={50 + 20 * n} model=2"
        for n in (1, 2, 3)
    ]
    found = imported(tmp_path, *loads, broken)
    assert {fate for fate, _ in told(found).values()} == {"as it is"}
    assert largest(found) < NEUTRAL


def test_nothing_flows_from_one_phase_to_a_neutral_of_its_own(tmp_path: Path) -> None:
    found = imported(tmp_path, "new load.x bus1=b.2.4 phases=1 kv=7.2 kw=500 kvar=100")
    assert told(found) == {"x": ("not fed", "nothing flows to its neutral, which nothing earths")}
    assert "x" not in {load.name for load in found.feeder.loads}
    assert largest(found) < NEUTRAL


@pytest.mark.parametrize(
    "earth",
    ["new reactor.e bus1=b.4 bus2=b.0 phases=1 r=0 x=0.001", "edit load.x rneut=0"],
)
def test_a_neutral_that_is_earthed_stays_so(earth: str, tmp_path: Path) -> None:
    found = imported(tmp_path, f"new load.x {STAR}", earth, "open line.l1 1 1")
    (load,) = (load for load in found.feeder.loads if load.name == "x")
    assert load.connection == "wye"
    # with an impedance in a load's neutral OpenDSS settles in the mode direct alone
    settled = [row.largest_pu for row in differences(found) if row.opendss_converged]
    assert max(settled) < 2e-5


def test_loads_return_through_a_windings_neutral_that_is_earthed_nowhere(tmp_path: Path) -> None:
    unit = "buses=[b d.1.2.3.4] conns=[delta wye] kvs=[12.47 0.48] kvas=[500 500] xhl=5"
    found = imported(
        tmp_path,
        f"new transformer.t windings=2 {unit}",
        "new load.x bus1=d.1.2.3.4 phases=3 kv=0.48 kw=90 kvar=30",
        "new load.x2 bus1=d.2.4 phases=1 kv=0.277 kw=40 kvar=10",
    )
    assert found.feeder.inline_transformers[0].connection == "D/Yg"
    assert {how for _, how in told(found).values()} == {"its neutral conductor is taken as earthed"}
    assert largest(found) < 3e-3  # which voltage the neutral has is nobody's law


def test_a_star_whose_mesh_would_generate_is_refused(tmp_path: Path) -> None:
    loads = (
        "new load.x1 bus1=b.1.4 phases=1 kv=7.2 kw=1 kvar=300 model=2",
        "new load.x2 bus1=b.2.4 phases=1 kv=7.2 kw=1 kvar=300 model=2",
        "new load.x3 bus1=b.3.4 phases=1 kv=7.2 kw=900 kvar=0 model=2",
    )
    with pytest.raises(InputError, match="would generate") as refused:
        imported(tmp_path, *loads)
    assert "902.0 kW" in str(refused.value)
    assert "--drop load.x2" in str(refused.value)
