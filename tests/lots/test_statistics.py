"""What the statistics of a lot say of figures that are known."""

from __future__ import annotations

import random

import pytest

from conformance.lots.inspection import Inspection, Numbers, Sampling, Try, Unit, Word
from conformance.lots.statistics import capability, drift, outliers, statistics_of


def tried(
    verdict: Word = "conforming",
    *,
    deviations: tuple[str, ...] = (),
    mean: float = 100.0,
    serial: str = "",
) -> Try:
    numbers = Numbers(
        item="HB-01/1017h", quantity="period", unit="ms", mean=mean, lowest=mean, highest=mean,
        least=90.0, most=110.0,
    )  # fmt: skip
    return Try(
        folder="",
        verdict=verdict,
        deviations=list(deviations),
        serial=serial,
        node_id=1,
        numbers=[numbers],
    )


def inspection(*units: list[Try]) -> Inspection:
    made = [Unit(unit=nth, tries=tries) for nth, tries in enumerate(units, 1)]
    plan = Sampling(sample=len(made), accept=0, size=len(made), words="")
    return Inspection(lot={}, sha256="", plan=plan, seed=0, units=made)


def test_units_are_counted_once_per_requirement() -> None:
    bad = tried("nonconforming", deviations=("HB-01/1017h/10ms", "HB-01/1017h/100ms"))
    other = tried("nonconforming", deviations=("OD-09/1018h:01", "HB-01/1017h/10ms"))
    numbers = statistics_of(inspection([bad, bad], [other], [tried()], []), None)
    assert numbers.by_requirement == {"HB-01": 2, "OD-09": 1}
    assert numbers.by_object == {"1017h": 2, "1018h:01": 1}
    assert (numbers.judged, numbers.conforming, numbers.first_pass) == (3, 1, 1)


def test_a_unit_that_conformed_only_in_its_second_run_is_no_first_pass() -> None:
    numbers = statistics_of(inspection([tried("undecided"), tried()], [tried()]), None)
    assert (numbers.conforming, numbers.first_pass) == (2, 1)


def test_what_a_wrong_sensor_deviated_from_is_not_the_units() -> None:
    wrong = tried("undecided", deviations=("HB-01/1017h",)).model_copy(update={"other": True})
    assert statistics_of(inspection([wrong]), None).by_requirement == {}


def test_capability_is_that_of_the_nearer_limit() -> None:
    assert capability(100, 1, 94, 112) == pytest.approx(2.0)
    assert capability(100, 2, None, 106) == pytest.approx(1.0)
    assert capability(100, 2, 103, None) == pytest.approx(-0.5)


def test_quantities_tell_capability_drift_and_outliers() -> None:
    rising = [100 + nth / 10 for nth in range(20)]
    numbers = statistics_of(inspection(*[[tried(mean=it)] for it in rising]), None)
    (quantity,) = numbers.quantities
    assert quantity.drift_per_unit == pytest.approx(0.1)
    assert quantity.cpk == pytest.approx((110 - 100.95) / (3 * 0.591608), rel=1e-4)
    assert quantity.outliers == ()


def test_few_units_and_units_without_spread_tell_no_capability() -> None:
    few = statistics_of(inspection(*[[tried(mean=100 + n)] for n in range(5)]), None)
    same = statistics_of(inspection(*[[tried()] for _ in range(20)]), None)
    assert few.quantities[0].cpk is None
    assert same.quantities[0].cpk is None
    assert same.quantities[0].mean == 100


def test_units_that_were_not_decided_tell_no_figures() -> None:
    assert statistics_of(inspection([tried("undecided")]), None).quantities == ()


def test_chance_is_no_drift() -> None:
    found = 0
    for seed in range(200):
        thrown = random.Random(seed)  # noqa: S311 - it must be repeatable
        values = [thrown.gauss(100, 1) for _ in range(30)]
        found += drift(range(30), values) is not None
    assert found <= 1


def test_one_unit_far_from_the_others_is_an_outlier() -> None:
    values = [(nth, 100 + nth % 5 / 10) for nth in range(20)]
    assert outliers(values) == ()
    assert outliers([*values, (99, 105.0)]) == (99,)
    assert outliers([(nth, 100.0) for nth in range(9)] + [(9, 101.0)]) == (9,)


def test_serial_numbers_told_twice_or_not_in_the_list_are_named() -> None:
    told = [["1"], ["2"], ["2"], ["7"], [""]]
    made = inspection(*[[tried(serial=it) for it in row] for row in told])
    serials = statistics_of(made, [1, 2, 3, 4, 5]).serials
    assert (serials.told, serials.twice) == (4, ("2",))
    assert (serials.unlisted, serials.missing) == (("7",), ("3", "4"))
    assert statistics_of(made, None).serials.unlisted == ()
