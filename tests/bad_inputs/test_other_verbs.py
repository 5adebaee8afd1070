"""The verbs that read a study, a plan or observations: what they refuse, and what stays."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

from covertool.gis.sample import SAMPLE_STUDY, sample_folder
from tests.bad_inputs.conftest import CRS, EAST_M, NORTH_M, Outcome, Run, Town, assert_refused

STUDY = sample_folder() / SAMPLE_STUDY
READERS = {
    "info": ["info", "{path}"],
    "report": ["report", "{path}", "-o", "{folder}/out.html"],
    "export": ["export", "{path}", "-o", "{folder}/out.xlsx"],
    "export a layer": ["export", "{path}", "--layer", "anchors", "-o", "{folder}/out.kml"],
    "coverage": ["coverage", "{path}", "--radius", "15", "-o", "{folder}/out.gpkg"],
    "convert": ["convert", "{path}:anchors", "{folder}/out.parquet"],
    "simulate": ["simulate", "{path}", "-o", "{folder}/out.gpkg"],
}


def ask(verb: str, path: Path, run: Run) -> Outcome:
    words = [word.format(path=path, folder=path.parent) for word in READERS[verb]]
    outcome = run(*words)
    assert not list(path.parent.glob("out.*"))
    return outcome


def study_of(kind: str, path: Path) -> Path:
    """Make a study that is broken in one way."""
    whole = STUDY.read_bytes()
    if kind == "cut off":
        path.write_bytes(whole[: len(whole) // 3])
    elif kind == "pages of zeros":
        half = len(whole) // 2 // 4096 * 4096
        path.write_bytes(whole[:4096] + bytes(half) + whole[4096 + half :])
    elif kind == "no GeoPackage":
        with closing(sqlite3.connect(path)) as base:
            base.execute("CREATE TABLE t (a)")
            base.commit()
    elif kind == "header only":
        path.write_bytes(whole[:100])
    elif kind == "garbage":
        path.write_bytes(b"SQLite format 3\x00" + bytes(range(256)) * 64)
    return path


@pytest.mark.parametrize("kind", ["cut off", "no GeoPackage", "header only", "garbage"])
@pytest.mark.parametrize("verb", READERS)
def test_a_study_that_is_broken_is_refused_by_every_verb(
    verb: str, kind: str, tmp_path: Path, run: Run
) -> None:
    assert_refused(ask(verb, study_of(kind, tmp_path / "broken.gpkg"), run), "broken.gpkg")


@pytest.mark.parametrize("verb", ["info", "export a layer", "coverage"])
def test_a_study_with_lost_pages_is_refused_or_read_as_far_as_it_is_sound(
    verb: str, tmp_path: Path, run: Run
) -> None:
    path = study_of("pages of zeros", tmp_path / "broken.gpkg")
    outcome = run(*(w.format(path=path, folder=tmp_path) for w in READERS[verb]))
    assert outcome.code in (0, 1), outcome
    assert "Traceback" not in outcome.err


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE anchors SET geom = x'4750000300000000'",
        "UPDATE anchors SET geom = 'text'",
        "UPDATE anchors SET geom = x'47500001E6100000FFFFFFFFFF'",
        "UPDATE gpkg_geometry_columns SET srs_id = 424242",
        "UPDATE gpkg_contents SET table_name = 'anchors; DROP TABLE transit' "
        "WHERE table_name = 'anchors'",
        "DELETE FROM gpkg_geometry_columns",
        "DROP TABLE gpkg_spatial_ref_sys",
        "UPDATE gpkg_spatial_ref_sys SET definition = 'nonsense', organization_coordsys_id = 1",
    ],
    ids=[
        "short blobs", "texts for blobs", "foreign blobs", "unknown system", "odd name",
        "no geometry", "no systems", "system of nonsense",
    ],
)  # fmt: skip
def test_a_tampered_study_is_refused_or_told_and_never_a_traceback(
    change: str, tmp_path: Path, run: Run
) -> None:
    path = tmp_path / "tampered.gpkg"
    shutil.copyfile(STUDY, path)
    with closing(sqlite3.connect(path)) as base:
        base.execute("PRAGMA foreign_keys = OFF")
        triggers = base.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall()
        for (name,) in triggers:
            base.execute(f'DROP TRIGGER "{name}"')
        with contextlib.suppress(sqlite3.IntegrityError):
            base.execute(change)
        base.commit()
    for verb in ("coverage", "info"):
        outcome = run(*(w.format(path=path, folder=tmp_path) for w in READERS[verb]), "--json")
        assert outcome.code in (0, 1), outcome
        assert "Traceback" not in outcome.err
        if outcome.code == 1:
            assert_refused(outcome, "tampered.gpkg")


def test_a_trigger_in_a_study_does_not_run_on_reading(tmp_path: Path, run: Run) -> None:
    """A view that calls SQL functions, and triggers on every table: reading changes nothing."""
    path = tmp_path / "armed.gpkg"
    shutil.copyfile(STUDY, path)
    with closing(sqlite3.connect(path)) as base:
        base.execute("CREATE TABLE loot (a)")
        base.execute(
            "CREATE TRIGGER armed AFTER INSERT ON gpkg_contents BEGIN "
            "INSERT INTO loot VALUES (1); END"
        )
        base.commit()
    before = path.read_bytes()
    assert run("coverage", path, "--radius", 15, "-o", tmp_path / "out.gpkg").code == 0
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir() if "armed" in p.name] == ["armed.gpkg"]


def test_markup_in_names_stays_text_in_the_report(tmp_path: Path, run: Run) -> None:
    path = tmp_path / "markup.gpkg"
    attack = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
    shutil.copyfile(STUDY, path)
    zone = shapely.box(EAST_M - 300, NORTH_M - 300, EAST_M + 300, NORTH_M + 300)
    zones = tmp_path / "zones.gpkg"
    gpd.GeoDataFrame({"name": [attack]}, geometry=[zone], crs=CRS).to_file(zones)
    coverage = run("coverage", path, "--radius", 15, "--by", f"{zones}:name", "--into", path)
    assert coverage.code == 0, coverage.err
    assert run("report", path, "-o", tmp_path / "r.html").code == 0
    page = (tmp_path / "r.html").read_text()
    assert "<script>alert" not in page
    assert "<img src=x" not in page
    assert "alert(1)" in page


def test_formulas_stay_text_in_workbooks_and_tables(town: Town, run: Run, tmp_path: Path) -> None:
    zone = shapely.box(EAST_M - 300, NORTH_M - 300, EAST_M + 300, NORTH_M + 300)
    zones = tmp_path / "zones.gpkg"
    gpd.GeoDataFrame({"name": ["=cmd|' /C calc'!A0"]}, geometry=[zone], crs=CRS).to_file(zones)
    study = tmp_path / "s.gpkg"
    shutil.copyfile(STUDY, study)
    code = run("coverage", study, "--radius", 15, "--by", f"{zones}:name", "--into", study).code
    assert code == 0
    assert run("export", study, "-o", tmp_path / "t.xlsx").code == 0
    import openpyxl

    book = openpyxl.load_workbook(tmp_path / "t.xlsx")
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
    assert any("calc" in str(cell.value) for cell in cells)
    assert not [cell.coordinate for cell in cells if cell.data_type == "f"]


@pytest.mark.parametrize(
    "text",
    [
        "", "[study", "a = 1" * 3, "[study]\npath = 3\n", '[study]\npath = "a.gpkg"\n',
        '[study]\npath = "a.gpkg"\n[coverage]\nradios = 15\n',
        '[study]\npath = "a.gpkg"\n[coverag]\nradius = 15\n',
        '[study]\npath = "a.gpkg"\n[coverage]\nradius = ' + "[" * 5000 + "]" * 5000,
        '[study]\npath = "a.gpkg"\n[coverage]\nradius = ' + "9" * 5000,
        '[study]\npath = "a.gpkg"\n[coverage]\nradius = 2026-13-40\n',
        '[study]\npath = "a\\u0000.gpkg"\n[extract]\nimages = "\\u0000*"\n',
        '[study]\npath = "a.gpkg"\n[extract]\nimages = "' + "x" * 5000 + '*"\n',
    ],
    ids=[
        "empty", "cut", "twice", "number for a path", "no stage", "unknown key", "unknown stage",
        "deep nesting", "long number", "no date", "zero byte", "long pattern",
    ],
)  # fmt: skip
def test_a_plan_that_is_none_is_refused(text: str, tmp_path: Path, run: Run) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(text)
    assert_refused(run("run", path), "plan.toml")
    assert [found.name for found in tmp_path.iterdir()] == ["plan.toml"]


@pytest.mark.parametrize("name", ["absent.toml", "folder.toml", "binary.toml"])
def test_a_plan_that_cannot_be_read_is_refused(name: str, tmp_path: Path, run: Run) -> None:
    if name == "folder.toml":
        (tmp_path / name).mkdir()
    elif name == "binary.toml":
        (tmp_path / name).write_bytes(bytes(range(256)))
    assert_refused(run("run", tmp_path / name), name)


SEEN = "time,segment_id,status\n2026-01-05T08:00:00Z,a,slow\n"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("absent.csv", None),
        ("empty.csv", b""),
        ("binary.csv", b"\x00\xff\x80" * 99),
        ("binary.parquet", b"PAR1" + b"\xff" * 99 + b"PAR1"),
        ("columns.csv", b"a,b\n1,2\n"),
        ("status.csv", SEEN.replace("slow", "purple").encode()),
        ("time.csv", SEEN.replace("2026-01-05", "2026-99-05").encode()),
        ("twice.csv", SEEN.replace("status", "Segment_ID", 1).encode()),
        ("latin.csv", SEEN.replace(",a,", ",\xe4,").encode("latin-1")),
        ("seen.docx", SEEN.encode()),
        ("seen.kml", SEEN.encode()),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_observations_that_are_none_are_refused(
    name: str, content: bytes | None, town: Town, run: Run, tmp_path: Path
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    line = shapely.LineString([(EAST_M, NORTH_M), (EAST_M + 90, NORTH_M)])
    net = gpd.GeoDataFrame({"segment_id": ["a"]}, geometry=[line], crs=CRS)
    segments = town.write("net.gpkg", net)
    outcome = run("congestion", "table", path, "--segments", segments, "--tz", "UTC", "--json")
    assert_refused(outcome, name)


@pytest.mark.parametrize("kind", ["no column", "no line", "twice", "empty"])
def test_segments_that_are_none_are_refused_or_told(
    kind: str, town: Town, run: Run, tmp_path: Path
) -> None:
    seen = tmp_path / "seen.csv"
    seen.write_text(SEEN)
    line = shapely.LineString([(EAST_M, NORTH_M), (EAST_M + 90, NORTH_M)])
    rows: dict[str, tuple[list[object], list[object]]] = {
        "no column": ([1], [line]),
        "no line": (["a"], [shapely.Point(EAST_M, NORTH_M)]),
        "twice": (["a", "a"], [line, line]),
        "empty": ([], []),
    }
    ids, lines = rows[kind]
    column = "name" if kind == "no column" else "segment_id"
    frame = gpd.GeoDataFrame({column: pd.Series(ids)}, geometry=lines, crs=CRS)
    path = town.write("net.gpkg", frame)
    outcome = run("congestion", "table", seen, "--segments", path, "--tz", "UTC", "--json")
    if kind == "twice":
        assert outcome.code == 0, outcome.err
        assert "given twice" in outcome.err
    else:
        assert_refused(outcome, "net.gpkg")


@pytest.mark.parametrize("share", ["-0.1", "1.5", "nan", "much"])
def test_shares_outside_0_to_1_are_refused(share: str, town: Town, coverage: Run) -> None:
    outcome = coverage("--penetration", share)
    assert outcome.code in (1, 2)
    assert "Traceback" not in outcome.err
    assert outcome.out == ""


def test_one_layer_name_in_two_cases_is_one_layer(town: Town, coverage: Run) -> None:
    """GeoPackage names know no case; a clash is refused or resolved, and never half written."""
    path = town.write("two.gpkg", town.anchors, layer="anchors")
    town.write("two.gpkg", town.transit, layer="transit")
    outcome = coverage(anchors=f"{path}:ANCHORS")
    assert outcome.code in (0, 1)
    assert "Traceback" not in outcome.err


def test_numbers_at_the_edge_of_floats_are_places_or_dropped(town: Town, coverage: Run) -> None:
    tiny = np.nextafter(0, 1)
    far = [shapely.Point(1e308, 1e308), shapely.Point(-1e300, tiny), shapely.Point(tiny, -tiny)]
    frame = pd.concat(
        [town.anchors, gpd.GeoDataFrame({"id": ["x", "y", "z"]}, geometry=far, crs=CRS)],
        ignore_index=True,
    )
    outcome = coverage(anchors=town.write("far.gpkg", frame))
    assert outcome.code == 0, outcome.err
    assert outcome.fractions() == pytest.approx(coverage().fractions(), abs=1e-9)
