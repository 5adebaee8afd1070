"""What `covertool simulate` is given: nets, traces, routes, extracts, broken or hostile."""

from __future__ import annotations

import gzip
import importlib.util
import zlib
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from tests.bad_inputs.conftest import CRS, EAST_M, NORTH_M, Outcome, Run, Town, assert_refused

needs_sumo = pytest.mark.skipif(
    importlib.util.find_spec("sumo") is None, reason="SUMO is not installed"
)
Simulate = Callable[..., Outcome]

BOMB = (
    '<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "' + "a" * 1000 + '">'
    + "".join(f'<!ENTITY {c} "{f"&{p};" * 10}">' for p, c in pairwise("abcdefghi"))
    + "]>"
)  # fmt: skip
DEEP = b"<a>" * 100_000
HEAD = "time,id,x,y,angle,speed\n"


def net_text(projection: str = "!") -> str:
    shape = f"{EAST_M - 100},{NORTH_M} {EAST_M + 100},{NORTH_M}"
    return (
        f'<net><location netOffset="0,0" projParameter="{projection}"/>'
        '<edge id="e" from="a" to="b"><lane id="e_0" index="0" speed="9" length="200" '
        f'shape="{shape}"/></edge></net>'
    )


@pytest.fixture
def trace(town: Town) -> Path:
    """Two cars that drive east through the town, 20 m apart."""
    rows = [
        f"{t},{name},{EAST_M - 80 - back + 5 * t},{NORTH_M},90,5"
        for t in range(20)
        for name, back in (("a", 0), ("b", 20))
    ]
    path = town.folder / "cars.csv"
    path.write_text(HEAD + "\n".join(rows) + "\n")
    return path


@pytest.fixture
def simulate(town: Town, trace: Path, run: Run) -> Simulate:
    """Run ``simulate`` on the clean trace, unless told otherwise."""

    def run_simulate(
        *more: object, fcd: Path | str | None = trace, anchors: Path | None = None
    ) -> Outcome:
        traffic = ["--fcd", fcd] if fcd else []
        crs = [] if "--net" in more or "--osm" in more else ["--crs", CRS]
        return run(
            "simulate", *traffic, *crs, "--anchors", anchors or town.anchors_file(),
            "--estimator", "ekf", "--arm", "gps", "--runs", 1, "--no-bound", "--json", *more,
        )  # fmt: skip

    return run_simulate


def gzip_bomb(megabytes: int) -> bytes:
    """Return a gzip file of spaces: a thousandth of what it unpacks to."""
    squeeze = zlib.compressobj(9, zlib.DEFLATED, 31)
    parts = [squeeze.compress(b"<net>")]
    parts += [squeeze.compress(b" " * 2**20) for _ in range(megabytes)]
    return b"".join([*parts, squeeze.flush()])


def broken(kind: str, whole: bytes) -> bytes:
    """Return a file's bytes spoiled in one way."""
    packed = bytearray(gzip.compress(whole * 50, mtime=0))
    if kind == "damaged gzip":
        packed[len(packed) // 2 :] = b"\xff" * (len(packed) - len(packed) // 2)
    spoilt: dict[str, bytes] = {
        "zero bytes": b"",
        "garbage": b"\x00\x01garbage\xff" * 40,
        "gzip magic only": b"\x1f\x8bgarbage" * 40,
        "damaged gzip": bytes(packed),
        "cut gzip": bytes(packed[: len(packed) // 2]),
        "deep nesting": DEEP,
        "pickle": b"\x80\x04\x95\x10\x00\x00\x00\x00\x00\x00\x00\x8c\x05posix\x94.",
    }
    return spoilt[kind]


KINDS = [
    "zero bytes", "garbage", "gzip magic only", "damaged gzip", "cut gzip", "deep nesting",
    "pickle",
]  # fmt: skip


def test_the_clean_trace_and_net_give_an_answer(simulate: Simulate, town: Town) -> None:
    assert simulate().code == 0
    net = town.folder / "town.net.xml"
    net.write_text(net_text())
    outcome = simulate("--net", net, "--net-crs", CRS)
    assert outcome.code == 0, outcome.err


@pytest.mark.parametrize("name", ["town.net.xml", "town.net.xml.gz"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_net_that_is_none_is_refused(
    name: str, kind: str, simulate: Simulate, town: Town
) -> None:
    net = town.folder / name
    net.write_bytes(broken(kind, net_text().encode()))
    output = town.folder / "out.gpkg"
    assert_refused(simulate("--net", net, "--net-crs", CRS, "-o", output), name)
    assert not output.exists()


@pytest.mark.parametrize(
    "name", ["cars.csv", "cars.csv.gz", "cars.xml", "cars.xml.gz", "cars.parquet"]
)
@pytest.mark.parametrize("kind", KINDS)
def test_a_trace_that_is_none_is_refused(
    name: str, kind: str, simulate: Simulate, town: Town
) -> None:
    path = town.folder / name
    path.write_bytes(broken(kind, (HEAD + "0,a,1,2,3,4\n" * 50).encode()))
    assert_refused(simulate(fcd=path), name)


@pytest.mark.parametrize(
    "text",
    [
        HEAD,
        HEAD + "0,a,nan,nan,90,5\n",
        HEAD + "0,a,1e300,1e300,90,5\n",
        HEAD + "0,a,1,2,90,inf\n",
        HEAD + "inf,a,1,2,90,5\n",
        HEAD + "0,a,1,2,90,5\n0,a,1,2,90,5\n",
        HEAD + "0,a,1,2\n",
        HEAD + '0,"a,1,2,90,5\n',
        "time,id,x,y,angle\n0,a,1,2,90\n",
        "time,id,x,x,y,angle,speed\n0,a,1,1,2,90,5\n",
        "\x00" * 500,
    ],
    ids=[
        "no rows", "NaN", "beyond the Earth", "infinite speed", "infinite time", "twice",
        "short rows", "open quote", "column missing", "column twice", "zeros",
    ],
)  # fmt: skip
def test_a_trace_of_nonsense_is_refused(text: str, simulate: Simulate, town: Town) -> None:
    path = town.folder / "bad.csv"
    path.write_text(text)
    assert_refused(simulate(fcd=path), "bad.csv")


@pytest.mark.parametrize(
    "path", ["http://example.com/a.xml", "/vsicurl/http://h/a.csv", "s3://b/c.csv"]
)
def test_remote_traffic_is_refused(path: str, simulate: Simulate) -> None:
    assert_refused(simulate(fcd=path))
    assert_refused(simulate("--net", path))


@pytest.mark.parametrize("option", ["--net", "--fcd", "--osm", "--routes"])
def test_an_entity_bomb_in_traffic_is_refused_at_once(
    option: str, simulate: Simulate, town: Town
) -> None:
    name = {"--net": "b.net.xml", "--fcd": "b.xml", "--osm": "b.osm", "--routes": "b.rou.xml"}[
        option
    ]
    path = town.folder / name
    root = {"--net": "net", "--fcd": "fcd-export", "--osm": "osm", "--routes": "routes"}[option]
    path.write_text(f"{BOMB}<{root}>&i;</{root}>")
    if option == "--fcd":
        assert_refused(simulate(fcd=path), name)
    elif option == "--net":
        assert_refused(simulate("--net", path), name)
    elif importlib.util.find_spec("sumo") is None:
        pytest.skip("SUMO is not installed")
    elif option == "--osm":
        assert_refused(simulate("--osm", path, fcd=None), name)
    else:
        net = town.folder / "town.net.xml"
        net.write_text(net_text())
        assert_refused(simulate("--net", net, "--net-crs", CRS, "--routes", path, fcd=None), name)


@needs_sumo
@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('<routes><trip id="t" depart="0" from="e" to="nowhere"/></routes>', "nowhere"),
        ('<routes><vehicle id="t" depart="0"><route edges="x y"/></vehicle></routes>', "x, y"),
        ("<routes/>", "no vehicle"),
        ("garbage", "damaged"),
        ("", "empty"),
    ],
)
def test_routes_that_the_net_does_not_know_are_refused(
    text: str, told: str, simulate: Simulate, town: Town
) -> None:
    net, routes = town.folder / "town.net.xml", town.folder / "cars.rou.xml"
    net.write_text(net_text())
    routes.write_text(text)
    outcome = simulate("--net", net, "--net-crs", CRS, "--routes", routes, fcd=None)
    assert_refused(outcome, "cars.rou.xml", told)


def test_a_gzip_bomb_is_refused_before_it_is_unpacked(simulate: Simulate, town: Town) -> None:
    bomb = gzip_bomb(80)
    assert len(bomb) < 2**18
    for name in ("town.net.xml.gz", "cars.xml.gz", "cars.csv.gz"):
        path = town.folder / name
        path.write_bytes(bomb)
        outcome = simulate("--net", path) if ".net." in name else simulate(fcd=path)
        assert_refused(outcome, name, *(["unpacks to more than"] if "csv" in name else []))


@pytest.mark.parametrize("kind", ["bomb", "damaged gzip", "cut gzip", "gzip magic only"])
def test_an_extract_that_is_packed_badly_is_refused(kind: str, run: Run, town: Town) -> None:
    path = town.folder / "town.osm.gz"
    whole = b'<?xml version="1.0"?><osm version="0.6"></osm>'
    path.write_bytes(gzip_bomb(80) if kind == "bomb" else broken(kind, whole))
    output = town.folder / "out.gpkg"
    outcome = run("anchors", "parked", "--osm", path, "-o", output)
    assert_refused(outcome, "town.osm.gz", *(["unpacks to more than"] if kind == "bomb" else []))
    assert not output.exists()


@pytest.mark.parametrize("projection", ["EPSG:4326", "+proj=nonsense", "http://example.com/crs"])
def test_a_net_in_no_metres_is_refused(projection: str, simulate: Simulate, town: Town) -> None:
    net = town.folder / "town.net.xml"
    net.write_text(net_text(projection))
    assert_refused(simulate("--net", net), "town.net.xml")


@pytest.mark.parametrize(
    "attribute", ['length="nan"', 'speed="1e999"', 'index="9e9"', 'shape="1,2"']
)
def test_a_lane_of_nonsense_is_refused(attribute: str, simulate: Simulate, town: Town) -> None:
    name = attribute.partition("=")[0]
    net = town.folder / "town.net.xml"
    text = net_text()
    start = text.index(f" {name}=") + 1
    end = text.index('"', text.index('"', start) + 1) + 1
    net.write_text(text[:start] + attribute + text[end:])
    assert_refused(simulate("--net", net, "--net-crs", CRS), "town.net.xml")


def test_one_endless_record_does_not_fill_the_memory(simulate: Simulate, town: Town) -> None:
    net = town.folder / "town.net.xml"
    net.write_bytes(b'<net><edge id="e">' + b"<lane/>" * 2_000_000 + b"</edge></net>")
    assert_refused(simulate("--net", net, "--net-crs", CRS), "town.net.xml", "one record")


def test_anchors_that_no_car_can_hear_are_told(simulate: Simulate, town: Town) -> None:
    frame = town.anchors.set_geometry(town.anchors.geometry.translate(50_000.0), crs=CRS)
    far = town.write("far.gpkg", frame)
    outcome = simulate("--arm", "proposed", anchors=far)
    assert_refused(outcome)
