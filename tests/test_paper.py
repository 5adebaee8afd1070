"""The paper's tables agree with themselves and with the text beside them."""

import math

import pytest

from covertool.dsrc import DEVICE_CLASSES, battery_hours
from covertool.paper import (
    BATTERY,
    TABLE_2,
    TABLE_4_PERCENT,
    TABLE_5,
    TABLE_6,
    TABLE_7,
    TABLE_8,
)


@pytest.mark.parametrize("row", [*TABLE_5, *TABLE_6, *TABLE_7])
def test_printed_improvement_is_one_minus_the_ratio_of_the_printed_means(row):
    percent = 100 * (1 - row.proposed_m[0] / row.traditional_m[0])
    # Means are off by up to half a unit of their last decimal; Table VI prints 11.4 with one.
    half_m = 0.05 if row.traditional_m[0] == 11.4 else 0.005
    slack = 100 * 2 * half_m / row.traditional_m[0]
    assert percent == pytest.approx(row.percent, abs=slack + 0.01)


def test_the_rows_are_the_28_of_the_paper():
    assert len(TABLE_5) + len(TABLE_6) + len(TABLE_7) == 28


def test_table_8_is_the_mean_of_the_four_improvements_of_each_car():
    for row in TABLE_8:
        four = [each.percent for each in (*TABLE_6, *TABLE_7) if each.car == row.car]
        assert len(four) == 4
        assert math.fsum(four) / 4 == pytest.approx(row.percent, abs=0.0051)


def test_table_8_density_is_cars_over_kilometres():
    for row in TABLE_8:
        # 2.34 km may stand for anything from 2.335 to 2.345.
        assert row.parked_met / row.path_km == pytest.approx(row.met_per_km, rel=0.005)


def test_levels_of_table_4_sum_to_all():
    for fractions in TABLE_4_PERCENT.values():
        assert math.fsum(fractions) == pytest.approx(100.0)


def test_our_device_classes_are_those_of_table_2():
    ours = {name: (one.max_power_dbm, one.radius_m) for name, one in DEVICE_CLASSES.items()}
    assert ours == TABLE_2


def test_battery_claim_is_the_battery_budget():
    hours = battery_hours(BATTERY.capacity_wh, BATTERY.share, BATTERY.load_w)
    assert hours == pytest.approx(BATTERY.hours)
