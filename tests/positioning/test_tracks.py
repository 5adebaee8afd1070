"""Tracks are the estimates behind the report: the same filter, the same noise."""

import dataclasses

import numpy as np
import pytest

from covertool.errors import OptionError
from covertool.positioning import PositioningOptions, Scenario, position_errors, position_tracks

from .circuit import circuit


def town(steps=30):
    trace, anchors = circuit(cars=6, steps=steps)
    # neither from zero nor in the order of time: what comes out is in the trace's own seconds
    turned = trace.take(np.random.default_rng(0).permutation(len(trace)))
    return Scenario(dataclasses.replace(turned, time_s=turned.time_s + 100.0), anchors)


@pytest.mark.parametrize(
    ("arm", "estimator", "options"),
    [
        ("proposed", "ekf", {}),
        ("traditional", "gcpso", {"choice": "measured"}),
        ("proposed", "second_order", {}),
        ("proposed", "second_order", {"smoothing": True}),
        ("gps", "ekf", {"gps_tau_s": 20.0}),
        ("gps_odometry", "ekf", {}),
    ],
)
def test_error_statistics_of_the_tracks_are_those_of_the_report(arm, estimator, options):
    shared = {"runs": 22, "seed": 5, "options": PositioningOptions(**options)}
    tracks = position_tracks(town(), arm=arm, estimator=estimator, sigma_m=0.5, **shared)
    report = position_errors(
        [town()],
        arms=(arm,),
        estimators=(estimator,),
        sigmas_m=(0.5,),
        vehicles=("car003",),
        bound=False,
        **shared,
    )
    assert len(tracks) == 22 * 6 * 30
    for result, rows in zip(report.results, (slice(None), tracks.vehicle == "car003"), strict=True):
        error = tracks.error_m[rows]
        assert result.samples == error.size
        assert result.mean_error_m == pytest.approx(error.mean(), rel=1e-12)
        assert result.sd_error_m == pytest.approx(error.std(), rel=1e-9)
        assert result.rmse_m == pytest.approx(np.sqrt((error**2).mean()), rel=1e-12)


def test_rows_are_ordered_by_run_time_and_car_and_carry_the_truth_of_the_trace():
    scenario = town()
    frame = position_tracks(scenario, runs=2).to_frame()
    assert frame.sort_values(["run", "time_s", "vehicle"]).index.tolist() == list(range(len(frame)))
    merged = frame.merge(scenario.trace.to_frame(), on=["time_s", "vehicle"])
    assert len(merged) == len(frame)
    assert (merged["true_x_m"] == merged["x_m"]).all()
    assert (merged["true_y_m"] == merged["y_m"]).all()


def test_chosen_cars_have_the_tracks_that_they_have_among_all():
    everyone = position_tracks(town(), runs=3)
    some = position_tracks(town(), runs=3, vehicles=("car004", "car001"))
    chosen = everyone.take(np.isin(everyone.vehicle, ["car001", "car004"]))
    assert some.to_frame().equals(chosen.to_frame())


def test_gps_errors_have_the_stated_deviation():
    tracks = position_tracks(town(steps=100), arm="gps", runs=20)
    error = np.concatenate([tracks.gps_x_m - tracks.true_x_m, tracks.gps_y_m - tracks.true_y_m])
    assert error.std() == pytest.approx(6.0, rel=0.03)
    assert (tracks.gps_x_m == tracks.estimated_x_m).all()


def test_a_car_that_diverged_has_no_estimate_from_there_on():
    options = PositioningOptions(divergence_m=12.0)
    tracks = position_tracks(town(), arm="gps", options=options)
    raw = np.hypot(tracks.gps_x_m - tracks.true_x_m, tracks.gps_y_m - tracks.true_y_m)
    for name in np.unique(tracks.vehicle):
        own = tracks.vehicle == name
        expected = np.maximum.accumulate(raw[own] >= 12.0)
        assert np.isnan(tracks.error_m[own]).tolist() == expected.tolist()
    assert np.isnan(tracks.error_m).any()


@pytest.mark.parametrize(
    "change",
    [{"arm": "both"}, {"estimator": "no"}, {"runs": 0}, {"vehicles": ("nobody",)}],
    ids=str,
)
def test_tracks_of_what_does_not_exist_are_refused(change):
    with pytest.raises(OptionError):
        position_tracks(town(), **change)
