import pytest

from covertool.dsrc import DEVICE_CLASSES, battery_hours, device_class
from covertool.errors import OptionError


def test_the_four_classes_are_those_of_the_fcc_table():
    table = {c.name: (c.max_power_dbm, c.radius_m) for c in DEVICE_CLASSES.values()}
    assert table == {"A": (0, 15), "B": (10, 100), "C": (20, 400), "D": (28.8, 1000)}


def test_a_tenth_of_a_car_battery_feeds_one_watt_for_two_days():
    assert battery_hours(capacity_wh=480, share=0.10, load_w=1.0) == 48


def test_half_the_duty_cycle_doubles_the_hours():
    assert battery_hours(duty_cycle=0.5) == 2 * battery_hours()


@pytest.mark.parametrize(
    "options", [{"share": 0}, {"share": 1.1}, {"load_w": 0}, {"duty_cycle": 2}]
)
def test_figures_out_of_range_are_refused(options):
    with pytest.raises(OptionError, match="out of range"):
        battery_hours(**options)


def test_an_unknown_class_is_refused_with_the_known_ones():
    with pytest.raises(OptionError) as caught:
        device_class("E")
    assert "A, B, C or D" in caught.value.mend
