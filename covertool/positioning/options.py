"""The open points of the paper, each an option with the reading that we take as default."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from covertool.errors import OptionError

Velocity = Literal["previous", "current"]
Sharing = Literal["gps", "prediction", "truth"]
Choice = Literal["nearest", "measured", "gdop", "all"]


@dataclass(frozen=True)
class PositioningOptions:
    """How the cars sense, share, choose and update; the defaults are the ``paper`` preset.

    Attributes
    ----------
    sigma_gps_m, gps_noise : GPS noise, ``axis`` (per axis) or ``radial`` (over both axes)
    gps_tau_s : correlation time of a Gauss-Markov GPS error in seconds; 0 is white
    sigma_velocity : noise of the measured velocity per axis in m/s
    velocity : which velocity carries the estimate on: v(t-1) ``previous`` or v(t) ``current``
    sharing : what a moving neighbour shares: its GPS fix, its prediction, or the truth
    range_growth : standard deviation of a range per metre of distance, see :func:`rssi_growth`
    nlos_share, nlos_mean_m : share of ranges without line of sight, and their mean extra length
    gps_reset_s : an isolated car takes its GPS fix after so many seconds; None: once the variance
        of its dead reckoning exceeds that of GPS
    pseudo_anchor : anchors used at t-1 that make a moving car a pseudo-anchor, or ``covariance``
        (the trace of its covariance is below the GPS variance of one axis)
    halted : cars halted in the trace become blind stationary cars (section IV-B)
    halted_after_s, halted_below : dwell time in seconds and speed in m/s of a halted car
    choice : the three by priority, then ``nearest`` by true or ``measured`` range, or by
        ``gdop``; or ``all``
    sequential : cars update one after another instead of all at once
    literal_r : the EKF ignores the neighbour's own error, as printed
    literal_cost : GCPSO's second term and particles lack the previous position, as printed
    smoothing : the second-order filter looks back over the whole trace (Rauch-Tung-Striebel)
    divergence_m : an error beyond which a car counts as diverged
    """

    sigma_gps_m: float = 6.0
    gps_noise: Literal["axis", "radial"] = "axis"
    gps_tau_s: float = 0.0
    sigma_velocity: float = 0.5
    velocity: Velocity = "previous"
    sharing: Sharing = "gps"
    range_growth: float = 0.0
    nlos_share: float = 0.0
    nlos_mean_m: float = 0.0
    gps_reset_s: float | None = 1.0
    pseudo_anchor: int | Literal["covariance"] = 3
    halted: bool = True
    halted_after_s: float = 5.0
    halted_below: float = 0.1
    choice: Choice = "nearest"
    sequential: bool = False
    literal_r: bool = False
    literal_cost: bool = False
    smoothing: bool = False
    divergence_m: float = 10_000.0

    def __post_init__(self) -> None:
        noises = (self.sigma_gps_m, self.gps_tau_s, self.sigma_velocity, self.range_growth)
        if not all(math.isfinite(value) and value >= 0 for value in (*noises, self.nlos_mean_m)):
            raise OptionError(
                "a noise is negative or not a number", f"{self}", "use finite numbers from 0"
            )
        if not 0 <= self.nlos_share <= 1:
            raise OptionError(
                "the share of ranges without line of sight is out of range",
                f"nlos_share={self.nlos_share}",
                "use 0 to 1",
            )

    @property
    def gps_axis_m(self) -> float:
        """Standard deviation of GPS along one axis in metres."""
        return self.sigma_gps_m / math.sqrt(2) if self.gps_noise == "radial" else self.sigma_gps_m

    def gps_correlation(self, step_s: float) -> float:
        """Return the correlation of the GPS errors of two steps."""
        return math.exp(-step_s / self.gps_tau_s) if self.gps_tau_s > 0 else 0.0

    def gps_fusion_variance_m2(self, step_s: float) -> float:
        """Return the variance that a filter without a GPS error state gives to every fix.

        ``sigma^2 (1 + a) / (1 - a)`` for fixes with correlation ``a``: white noise of the same
        power at low frequency, so that averaging many fixes is not trusted too much.
        """
        a = self.gps_correlation(step_s)
        return self.gps_axis_m**2 * (1 + a) / (1 - a)

    @property
    def follows_each_run(self) -> bool:
        """Whether the choice of neighbours depends on the noise, and so differs between runs."""
        return self.choice == "measured" or self.pseudo_anchor == "covariance"


def rssi_growth(shadowing_db: float = 4.0, path_loss_exponent: float = 2.0) -> float:
    """Return the standard deviation per metre of a range from received signal strength.

    ``ln(10) / 10 * shadowing / exponent``, the first-order error of a range under log-normal
    shadowing (Patwari et al. 2003).

    >>> round(rssi_growth(4, 2), 2)
    0.46
    """
    return math.log(10) / 10 * shadowing_db / path_loss_exponent
