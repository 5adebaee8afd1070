"""DSRC device classes and the battery budget of a parked car."""

from covertool.errors import OptionError
from covertool.model import DeviceClass

DEVICE_CLASSES: dict[str, DeviceClass] = {
    "A": DeviceClass("A", max_power_dbm=0.0, radius_m=15.0),
    "B": DeviceClass("B", max_power_dbm=10.0, radius_m=100.0),
    "C": DeviceClass("C", max_power_dbm=20.0, radius_m=400.0),
    "D": DeviceClass("D", max_power_dbm=28.8, radius_m=1000.0),
}
"""FCC classes of DSRC devices (Kenney 2011, the paper's Table II)."""

MEAN_STAY_H = 6.64
"""Mean duration of on-street parking in hours (Morency and Trépanier 2008, 61,000 events)."""


def device_class(name: str) -> DeviceClass:
    """Return the DSRC device class of a name, in either case.

    Raises
    ------
    OptionError
        When the name is none of A, B, C, D.

    Examples
    --------
    >>> device_class("b").radius_m
    100.0
    """
    try:
        return DEVICE_CLASSES[name.strip().upper()]
    except KeyError:
        raise OptionError(
            f"there is no DSRC device class {name!r}", "device class", "use A, B, C or D"
        ) from None


def battery_hours(
    capacity_wh: float = 480.0,
    share: float = 0.10,
    load_w: float = 1.0,
    duty_cycle: float = 1.0,
) -> float:
    """Return the hours for which a share of a car battery feeds an on-board unit.

    ``hours = capacity_wh * share / (load_w * duty_cycle)``; with the defaults the two days of
    Sommer, Eckhoff and Dressler 2014, which the paper quotes in section II-1.

    Parameters
    ----------
    capacity_wh : float
        Energy of the full battery in watt hours.
    share : float
        Share of it that may be used, in (0, 1].
    load_w : float
        Power of the unit while it is on, in watts.
    duty_cycle : float
        Share of time for which it is on, in (0, 1].

    Raises
    ------
    OptionError
        When a value is out of range.

    Examples
    --------
    >>> battery_hours(capacity_wh=480, share=0.10, load_w=1.0)
    48.0
    """
    if not (capacity_wh > 0 and load_w > 0 and 0 < share <= 1 and 0 < duty_cycle <= 1):
        raise OptionError(
            "a battery figure is out of range",
            f"capacity_wh={capacity_wh}, share={share}, load_w={load_w}, duty_cycle={duty_cycle}",
            "use a positive capacity and load, and a share and a duty cycle in (0, 1]",
        )
    return capacity_wh * share / (load_w * duty_cycle)
