"""What the benchmarks' runner promises: medians with spread, and a guard by ratio."""

import json

import pytest

from benchmarks.__main__ import TOLERANCE, guard, machine, markdown, together, worse
from benchmarks.rows import Row, side_by_side


def told(median, *, unit="x", higher=True):
    row = Row("areas", "peer", (median,), unit, higher).to_json()
    return {"room": "coverage", **row}


def test_a_row_tells_median_spread_and_whether_the_demand_is_met():
    row = Row("areas", "peer", (3.0, 1.0, 8.0), limit=2.0).to_json()
    assert (row["median"], row["least"], row["most"], row["met"]) == (3.0, 1.0, 8.0, True)
    assert Row("time", "", (3.0,), "s", False, 2.0).to_json()["met"] is False


def test_a_quick_run_makes_no_demands():
    assert Row("areas", "peer", (1.0,), limit=2.0).to_json(quick=True)["met"] is None


@pytest.mark.parametrize(("bound", "ratio"), [({"at_least": 1}, 4.0), ({"at_most": 1}, 0.25)])
def test_a_ratio_is_of_works_that_take_turns(bound, ratio):
    now = [0.0]

    def lasting(length):
        def work():
            now[0] += length

        return work

    row = side_by_side("a", "b", lasting(2), lasting(8), 3, clock=lambda: now[0], **bound)
    assert row.values == pytest.approx((ratio,) * 3)


@pytest.mark.parametrize(("higher", "bad"), [(True, 0.9), (False, 1 / 0.9)])
def test_the_guard_speaks_when_a_ratio_loses_more_than_the_tolerance(higher, bad):
    kept = [told(100.0, higher=higher)]
    left = 1 - TOLERANCE
    just = 100 * left if higher else 100 / left
    assert not worse(kept, [told(just, higher=higher)])
    assert len(worse(kept, [told(just * bad, higher=higher)])) == 1


def test_the_guard_looks_at_no_times_and_at_no_new_rows():
    assert not worse([told(1.0, unit="s", higher=False)], [told(9.0, unit="s", higher=False)])
    assert not worse([], [told(0.1)])


def test_the_guard_s_exit_code(tmp_path):
    path = tmp_path / "results.json"
    assert guard(path, [told(1.0)]) == 1
    path.write_text(json.dumps({"rows": [told(100.0)]}))
    assert guard(path, [told(90.0)]) == 0
    assert guard(path, [told(1.0)]) == 1


def test_the_page_names_the_machine_and_no_path():
    page = markdown({"machine": machine(), "rows": [told(2.0)]})
    assert machine()["processor"] in page
    assert "/" not in machine()["processor"]
    assert "| areas | peer | 2 x |" in page


def test_rooms_that_were_not_measured_keep_their_rows(tmp_path):
    path = tmp_path / "results.json"
    rows = [told(1.0) | {"room": room} for room in ("coverage", "start")]
    path.write_text(json.dumps({"rows": rows}))
    found = [told(2.0) | {"room": "raster"}, told(3.0) | {"room": "coverage"}]
    assert [(row["room"], row["median"]) for row in together(path, found)] == [
        ("coverage", 3.0), ("raster", 2.0), ("start", 1.0),
    ]  # fmt: skip
