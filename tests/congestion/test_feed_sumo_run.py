"""Edge data that SUMO itself writes, from an invented crossing with a queue."""

import importlib.util
import os
import subprocess
import xml.etree.ElementTree as ET
from collections import defaultdict
from datetime import UTC, datetime

import numpy as np
import pytest

from covertool.congestion.status import DATEX, status_of_speed
from tests.congestion.feedtools import read

# Importing sumo would point this process's PROJ at SUMO's database, which is too old for rasterio.
SPEC = importlib.util.find_spec("sumo")
pytestmark = pytest.mark.skipif(SPEC is None, reason="SUMO is not installed")

ROUTES = """<routes>
<flow id="f" begin="0" end="600" period="2" from="A1B1" to="B1C1"/>
<flow id="g" begin="0" end="600" period="4" from="B0B1" to="B1B2"/>
</routes>"""
MEANDATA = '<additional><edgeData id="m" file="edges.xml" freq="300"/></additional>'


@pytest.fixture(scope="module")
def edge_data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sumo")
    (folder / "r.xml").write_text(ROUTES)
    (folder / "a.xml").write_text(MEANDATA)
    home = os.path.dirname(SPEC.origin)
    tools = os.path.join(home, "bin")
    env = {**os.environ, "SUMO_HOME": home}

    def run(tool, *arguments):
        command = [os.path.join(tools, tool), *arguments]
        subprocess.run(command, cwd=folder, env=env, check=True, capture_output=True)

    run("netgenerate", "--grid", "--grid.number=3", "--grid.length=150", "-o", "n.xml",
        "--default-junction-type=traffic_light")  # fmt: skip
    run("sumo", "-n", "n.xml", "-r", "r.xml", "-a", "a.xml", "--end", "600", "--no-step-log")
    return (folder / "edges.xml").read_bytes()


def test_statuses_are_those_of_sumos_own_relative_speeds(edge_data):
    seen = read("sumo", edge_data, time=datetime(2014, 6, 16, 7, tzinfo=UTC))
    expected = defaultdict(list)
    for edge in ET.fromstring(edge_data).iter("edge"):
        relative = float(edge.get("speedRelative", "1"))
        expected[edge.get("id")].append(status_of_speed(np.array([relative]), DATEX)[0])
    found = defaultdict(list)
    for segment, status in zip(seen.segment_id, seen.status, strict=True):
        found[segment].append(status)
    assert found == expected
    assert len(set(seen.time.tolist())) == 2


def test_a_saturated_approach_is_slower_than_the_road_behind_the_crossing(edge_data):
    seen = read("sumo", edge_data, time=datetime(2014, 6, 16, 7, tzinfo=UTC))
    speed = dict(zip(seen.segment_id, seen.relative_speed, strict=True))
    assert speed["A1B1"] < speed["B1C1"] <= 1.2
