"""The report page as text: figures, names for what is missing, structure, safety."""

import base64
import hashlib
import json
import re
from pathlib import Path

import geopandas as gpd
import lxml.html
import numpy as np
import pytest
import shapely

from covertool.cli.report import read_parts
from covertool.errors import FileError
from covertool.gis.write import write_layers
from covertool.report.page import ReportStudy, report_page

EVIL = "<script>window.hacked = true</script>"


@pytest.fixture(scope="module")
def page(make_study, tmp_path_factory):
    study = make_study(tmp_path_factory.mktemp("page") / "town.gpkg")
    return report_page(read_parts(study))


@pytest.fixture(scope="module")
def tree(page):
    return lxml.html.fromstring(page)


def table(tree, caption: str) -> list[list[str]]:
    for found in tree.iter("table"):
        if found.findtext("caption").strip().startswith(caption):
            return [[cell.text_content() for cell in row] for row in found.iter("tr")]
    raise AssertionError(f"no table {caption!r}")


def test_the_levels_are_printed_as_the_study_holds_them(tree):
    assert table(tree, "Share of the transit area at each level") == [
        ["Radius", "Level 0", "Level 1", "Level 2", "Level 3", "Levels 1 to 3"],
        ["15 m", "40.00", "30.00", "20.00", "10.00", "60.00"],
        ["100 m", "5.00", "15.00", "25.00", "55.00", "95.00"],
    ]
    assert table(tree, "The same in square metres")[1][1:] == ["16,000", "12,000", "8,000", "4,000"]


def test_congestion_is_printed_day_by_window_with_a_dash_where_nothing_is_known(tree):
    assert table(tree, "Share of the street length")[1:] == [
        ["Monday", "22.64", "3.50", "–", "3.50"],
        ["weekday mean", "22.64", "3.50", "–", "–"],
    ]


def test_errors_stand_beside_their_bound_and_improvements_beside_their_interval(tree):
    errors = table(tree, "Position error over all cars")
    assert errors[0][-1] == "Lower bound (RMSE)"
    assert [row[0] for row in errors[1:]] == [
        "GPS alone",
        "without parked cars",
        "with parked cars",
    ]
    assert errors[3][1:3] == ["EKF, 15 m, σ 0.2 m", "6.45"]
    assert errors[3][-1] == "2.25"
    assert table(tree, "Improvement")[1] == ["EKF, 15 m, σ 0.2 m", "6.25", "5.50", "7.00"]


def test_synthetic_data_is_called_synthetic_and_other_data_is_not(page, make_study, tmp_path):
    assert "Synthetic data." in page
    plain = make_study(tmp_path / "real.gpkg", "transit", metadata={"title": "Real town"})
    assert "Synthetic data." not in report_page(read_parts(plain))


def test_every_missing_part_is_named_with_the_command_that_makes_it(make_study, tmp_path):
    study = make_study(tmp_path / "bare town.gpkg", "transit", "anchors", metadata={})
    tree = lxml.html.fromstring(report_page(read_parts(study)))
    commands = [code.text_content() for code in tree.xpath("//p[@class='missing']/code")]
    assert len(commands) >= 8
    for verb in ("coverage", "congestion table", "congestion map", "simulate"):
        assert any(command.startswith(f"covertool {verb} ") for command in commands)
    assert all("--into 'bare town.gpkg'" in command for command in commands)
    assert not tree.xpath("//figure")


def test_a_study_with_tables_alone_needs_no_map(make_study, tmp_path):
    study = make_study(tmp_path / "tables.gpkg", "coverage_summary", "positioning")
    tree = lxml.html.fromstring(report_page(read_parts(study)))
    assert not tree.xpath("//*[@id='map']")
    assert table(tree, "Position error over all cars")


def test_a_file_with_nothing_to_show_is_refused_with_a_mend(tmp_path):
    path = tmp_path / "other.gpkg"
    write_layers(path, {"trees": gpd.GeoDataFrame(geometry=[shapely.Point(1, 1)], crs=2157)})
    with pytest.raises(FileError, match="covertool transit"):
        report_page(read_parts(path))


def test_names_from_the_study_stay_text(page, tree):
    assert EVIL not in page
    scripts = tree.xpath("//script")
    assert len(scripts) == 3
    assert EVIL in [cell.text_content() for cell in tree.xpath("//tbody/tr/th")]
    data = next(s for s in scripts if s.get("type") == "application/json").text
    assert "<" not in data
    assert EVIL in json.dumps(json.loads(data))


def test_the_policy_lets_only_the_pages_own_scripts_run_and_nothing_load(tree):
    policy = tree.xpath("//meta[@http-equiv='Content-Security-Policy']/@content")[0]
    assert "default-src 'none'" in policy
    assert "unsafe-eval" not in policy
    allowed = set(re.findall(r"'sha256-([^']+)'", policy))
    run = [s.text for s in tree.xpath("//script") if s.get("type") is None]
    assert {base64.b64encode(hashlib.sha256(t.encode()).digest()).decode() for t in run} == allowed
    assert not tree.xpath("//script/@src | //img | //iframe | //link[@rel='stylesheet']")


def test_the_same_study_gives_the_same_text_again_in_the_same_process(make_study, tmp_path, page):
    study = make_study(tmp_path / "town.gpkg")
    assert report_page(read_parts(study)) == page


def test_tables_plots_and_headings_are_told_to_those_who_do_not_see_them(tree):
    assert tree.get("lang") == "en"
    assert len(tree.xpath("//main")) == len(tree.xpath("//h1")) == 1
    assert tree.xpath("//a[@class='skip']/@href") == ["#main"]
    for found in tree.iter("table"):
        assert found.findtext("caption").strip()
        assert all(head.get("scope") == "col" for head in found.xpath("./thead//th"))
        assert all(row[0].get("scope") == "row" for row in found.xpath("./tbody/tr"))
    for section in tree.iter("section"):
        assert tree.get_element_by_id(section.get("aria-labelledby")).tag == "h2"
    plots = tree.xpath("//div[@class='plot']")
    assert len(plots) == 5
    assert all(plot.get("role") == "img" and len(plot.get("aria-label")) > 40 for plot in plots)
    for field in tree.xpath("//input"):
        assert field.getparent().tag == "label"
    ids = tree.xpath("//@id")
    assert len(ids) == len(set(ids))
    for target in tree.xpath("//nav//a/@href"):
        assert target.removeprefix("#") in ids


def colours(css: str) -> dict[str, str]:
    return dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6})", css))


def luminance(colour: str) -> float:
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_every_text_colour_meets_wcag_aa_on_every_ground_in_light_and_dark(tree):
    css = tree.findtext(".//style")
    dark_at = css.index("prefers-color-scheme: dark")
    light = colours(css[:dark_at])
    dark = {**light, **colours(css[dark_at : css.index("* {")])}
    for scheme in (light, dark):
        for text in ("ink", "muted", "accent"):
            for ground in ("ground", "paper"):
                assert contrast(scheme[text], scheme[ground]) >= 4.5, (text, ground)
        assert contrast(scheme["ink"], scheme["note"]) >= 4.5


def test_a_layer_in_degrees_is_drawn_in_metres(make_study, tmp_path):
    study = read_parts(make_study(tmp_path / "town.gpkg", "transit", "anchors"))
    turned = {name: frame.to_crs(4326) for name, frame in study.layers.items()}
    text = report_page(ReportStudy(study.name, study.sha256, turned, {}, {}))
    data = json.loads(lxml.html.fromstring(text).xpath("//script[@id='figures']")[0].text)
    ranges = re.findall(r'"Range1d".*?"end": ?(\d+)', json.dumps(data["map"]))
    width_m, height_m = sorted(int(end) / 10 for end in ranges)[::-1]
    assert 400 < width_m < 450
    assert 100 < height_m < width_m


def test_a_big_study_is_simplified_with_its_tolerance_told_and_stays_under_5_mb():
    """12,000 patches of 40 corners and 30,000 anchors would take 8 MB as they are."""
    rng = np.random.default_rng(1)
    x, y = 1000 * rng.random((2, 30_000))
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rings = np.stack([20 * np.cos(turn), 20 * np.sin(turn)], axis=-1)
    patches = shapely.polygons(rings[None] + 10 * np.stack([x, y], axis=-1)[:12_000, None])
    points = shapely.points(693_000 + 10 * x, 737_000 + 10 * y)
    layers = {
        "transit": gpd.GeoDataFrame(geometry=shapely.transform(patches, _east), crs=2157),
        "anchors": gpd.GeoDataFrame(
            {"id": np.arange(30_000).astype(str)}, geometry=points, crs=2157
        ),
    }
    text = report_page(ReportStudy("big.gpkg", "0" * 64, layers, {}, {}))
    assert len(text.encode()) < 5_000_000
    told = re.search(r"drawn to within\s([\d.]+)\sm", text)
    assert told is not None
    assert float(told[1]) > 0.25
    assert "of 30,000 are drawn" in text


def _east(places: np.ndarray) -> np.ndarray:
    return places + np.array([693_000, 737_000])


def test_the_templates_are_part_of_the_package():
    import covertool.report.page as room

    folder = Path(room.__file__).parent / "templates"
    assert {p.name for p in folder.iterdir()} >= {"page.html", "page.css", "page.js", "blocks.html"}


def cars(study: ReportStudy) -> list[tuple[str, str, bool]]:
    from covertool.report.page.mapping import map_layers

    found = map_layers(study, study.layers)
    return [(o.key, o.form, o.shown) for o in found if o.key in ("cars", "vehicles")]


@pytest.mark.parametrize(
    ("ids", "drawn"),
    [
        (["a", "b"], [("cars", "car", True)]),
        (["a", "c"], [("vehicles", "car", False), ("cars", "mark", True)]),
    ],
)
def test_parked_cars_are_the_anchors_and_are_drawn_once(ids, drawn):
    places = [shapely.Point(0, 0), shapely.Point(50, 0)]
    vehicles = gpd.GeoDataFrame(
        {"id": ["a", "b"], "heading_deg": 90.0, "length_m": 4.4, "width_m": 1.8, "parked": True},
        geometry=[place.buffer(2) for place in places], crs=2157,
    )  # fmt: skip
    anchors = gpd.GeoDataFrame({"id": ids, "origin": "parked"}, geometry=places, crs=2157)
    study = ReportStudy("t.gpkg", "0" * 64, {"vehicles": vehicles, "anchors": anchors}, {}, {})
    assert cars(study) == drawn


def test_a_table_without_its_columns_is_left_out_with_a_warning(make_study, tmp_path, caplog):
    study = read_parts(make_study(tmp_path / "town.gpkg", "transit", "coverage_summary"))
    poor = study.tables["coverage_summary"].drop(columns="fraction")
    text = report_page(
        ReportStudy(study.name, study.sha256, study.layers, {"coverage_summary": poor}, {})
    )
    assert "covertool coverage" in text
    assert "lacks fraction" in caplog.text


def test_empty_geometries_are_passed_over():
    road = gpd.GeoDataFrame(geometry=[shapely.box(0, 0, 90, 50), None, shapely.Polygon()], crs=2157)
    empty = gpd.GeoDataFrame(geometry=[None], crs=2157)
    text = report_page(ReportStudy("t.gpkg", "0" * 64, {"transit": road, "anchors": empty}, {}, {}))
    assert 'value="transit"' in text
    assert 'value="cars"' not in text
