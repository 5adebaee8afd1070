"""The paper's Table I: from its own cells, and from observations that were made to match it."""

import csv

import geopandas as gpd
import pytest

from covertool.congestion.clock import zone
from covertool.congestion.feeds.protocol import FeedOptions, feed
from covertool.congestion.occupancy import occupancy_table
from covertool.congestion.options import OccupancyOptions
from covertool.gis.streams import open_stream
from covertool.model import Observations
from covertool.paper import TABLE_1_CELLS, TABLE_1_MEANS, table_1
from tests.congestion.town import SHARED

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="shared data is not here")


def test_the_four_printed_means_are_those_of_the_printed_cells():
    means = {(mean.group, mean.window): mean for mean in table_1().means}
    assert {key: mean.text for key, mean in means.items()} == {
        key: str(value) for key, value in TABLE_1_MEANS.items()
    }
    assert means["weekday", "lunch"].percent == pytest.approx(22.644)
    assert means["weekday", "evening"].percent == pytest.approx(15.712)
    assert means["weekend", "evening"].percent == pytest.approx(13.025)


@needs_shared
def test_the_table_is_the_papers():
    with (SHARED / "paper_table.csv").open() as file:
        rows = {row["weekday"]: row for row in csv.DictReader(file)}
    assert {day: (rows[day]["lunchtime_pct"], rows[day]["evening_pct"]) for day in rows} == dict(
        TABLE_1_CELLS
    )


@pytest.fixture(scope="module")
def dublin():
    if not SHARED.is_dir():
        pytest.skip("shared data is not here")
    with open_stream(SHARED / "SYNTHETIC_dublin_obs.csv") as stream:
        seen = Observations.concatenate(list(feed("csv").read(stream, FeedOptions())))
    return seen, gpd.read_file(SHARED / "dublin_trips_net.gpkg")


def test_fourteen_cells_come_out_to_a_thousandth_of_a_point(dublin):
    table = occupancy_table(*dublin, OccupancyOptions(zone("Europe/Dublin")))
    windows = ("lunch", "evening")
    assert len(table.cells) == 14
    for cell in table.cells:
        printed = float(TABLE_1_CELLS[cell.day][windows.index(cell.window)])
        assert cell.percent == pytest.approx(printed, abs=0.001)
    assert {cell.days for cell in table.cells if cell.day == "Monday"} == {2}


def test_the_mean_of_days_weighs_the_two_mondays(dublin):
    options = OccupancyOptions(zone("Europe/Dublin"), mean_of="days")
    means = {(m.group, m.window): m for m in occupancy_table(*dublin, options).means}
    assert means["weekday", "lunch"].percent == pytest.approx(21.934, abs=0.0005)
    assert means["weekday", "evening"].percent == pytest.approx(15.271, abs=0.0005)
    assert means["weekday", "lunch"].count == 6
