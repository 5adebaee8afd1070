"""`covertool reproduce`: the paper's value, ours, the difference, and the verdict."""

import contextlib
import io
import json

import numpy as np
import pandas as pd
import pytest

from covertool.cli.main import main
from covertool.paper.comparison import Comparison, over_layouts, summary
from covertool.paper.reproduce import compare_errors, compare_table_8
from covertool.paper.scenarios import Errors, LayoutResult, Met


def run(*arguments):
    out, told = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(told):
        code = main(["reproduce", *map(str, arguments)])
    return code, out.getvalue(), told.getvalue()


def test_tables_1_2_and_4_stand_beside_ours(tmp_path):
    given = ("--table", 1, "--table", 2, "--table", 4)
    code, out, told = run(*given, "--json", "-o", tmp_path / "tables.csv")
    assert code == 0, told
    found = json.loads(out)
    rows = found["comparisons"]
    assert {row["table"] for row in rows} == {1, 2, 4}
    for row in rows:
        assert row["difference"] == pytest.approx(row["ours"] - row["paper"])
    assert [row["ours"] for row in rows if row["table"] == 1][:4] == [22.64, 15.71, 14.36, 13.03]
    assert all(row["difference"] == 0 for row in rows if row["table"] == 2)
    (battery,) = [row for row in rows if row["row"].startswith("battery")]
    assert (battery["paper"], battery["ours"]) == (48.0, 48.0)
    assert {row["note"] for row in rows if row["table"] == 4} == {"calibrated"}
    assert set(found["differences"]) == {"1", "2", "4"}
    assert len(pd.read_csv(tmp_path / "tables.csv")) == len(rows)


def test_the_calibrated_table_is_marked_in_the_text_and_the_markdown(tmp_path):
    code, out, told = run("--table", 4, "-o", tmp_path / "t.md")
    assert code == 0, told
    assert "no evidence" in out
    assert "calibrated" in (tmp_path / "t.md").read_text()


@pytest.mark.parametrize("wrong", [("--table", 3), ("--preset", "worst"), ("--layouts", 0)])
def test_what_does_not_fit_is_a_usage_error(wrong):
    assert run(*wrong)[0] == 2


def layout(percent, met=10):
    """A layout in which every improvement is the same."""
    errors = {
        (estimator, sigma_m, radius_m, car): Errors((10.0, 5.0), (10 - percent / 10, 4.0), percent)
        for estimator in ("gcpso", "ekf", "second_order")
        for sigma_m in (0.2, 4.0)
        for radius_m in (15.0, 100.0)
        for car in range(6)
    }
    cars = {car: Met(met * car, 2.0) for car in range(1, 6)}
    return LayoutResult(errors, cars, 7.5, 2.2, 600, 295)


def test_scatter_sign_and_verdict_are_those_of_the_layouts():
    results = [layout(percent) for percent in (-5.0, 5.0, 10.0, 20.0)]
    rows = compare_errors(5, results)
    assert len(rows) == 8 * 5
    better = [row for row in rows if row.quantity == "improvement, %"]
    low, high = np.percentile([-5.0, 5.0, 10.0, 20.0], [2.5, 97.5])
    for row in better:
        assert row.ours == pytest.approx(7.5)
        assert row.interval == pytest.approx((low, high))
        assert row.same_sign == 0.75
        assert row.inside is bool(low <= row.paper <= high)
        assert row.best == pytest.approx(7.5)
    assert {row.paper for row in better if row.inside} == {8.74, 4.82, 9.92, 7.65}
    assert "4 of 8" not in summary(better)[0]
    assert summary(better)[1].startswith("4 of 8")


def test_table_8_takes_the_mean_of_the_four_improvements():
    rows = {(row.row, row.quantity): row for row in compare_table_8([layout(30.0)])}
    assert rows["car 2", "parked cars met"].ours == 20
    assert rows["car 2", "met per km"].ours == 10
    assert rows["car 2", "improvement, %"].ours == pytest.approx(30.0)


def test_a_layout_in_which_a_car_diverged_is_left_out_and_told():
    row = over_layouts(5, "EKF", "improvement, %", 9.92, [10.0, None, 12.0], signed=True)
    assert (row.ours, row.each) == (11.0, (10.0, 12.0))
    assert row.note == "diverged in 1 layouts"


def test_one_layout_has_no_interval_and_so_no_verdict():
    row = over_layouts(5, "EKF", "improvement, %", 9.92, [10.0], signed=True)
    assert (row.interval, row.inside) == (None, None)


def test_an_unsigned_figure_claims_no_sign():
    assert Comparison(5, "EKF", "mean, m", 6.9, 7.0, (7.0, 7.1)).same_sign is None


@pytest.mark.slow
def test_table_5_is_driven_and_can_be_taken_up(tmp_path):
    given = ("--table", 5, "--runs", 1, "--preset", "paper", "--resume", tmp_path / "layouts")
    code, out, told = run(*given, "--json")
    assert code == 0, told
    first = json.loads(out)
    assert len(first["comparisons"]) == 8 * 5
    assert all(row["ours"] is not None for row in first["comparisons"])
    assert all(row["best"] is None for row in first["comparisons"])
    assert first["without_ranges"]["campus"][0]["vehicles"] == 12
    again = json.loads(run(*given, "--json")[1])
    assert again["comparisons"] == first["comparisons"]
