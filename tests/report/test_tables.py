"""Tables of a study: what it holds, its numbers unchanged; what it lacks, with the verb's name."""

import json

import numpy as np
import pandas as pd
import pytest

from covertool.errors import FileError, OptionError
from covertool.report.dictionary import heading, meaning
from covertool.report.findings import Findings
from covertool.report.parts import PARTS
from covertool.report.tables import ALWAYS, TABLE_NAMES, sheet, sheets

AREAS = (50.0, 30.0, 15.0, 5.0)
SUMMARY = pd.DataFrame(
    {
        "device_class": np.array(["A"] * 4 + [None] * 4, dtype=object),
        "radius_m": [15.0] * 4 + [np.nan] * 4,
        "level": [0, 1, 2, 3] * 2,
        "area_m2": [*AREAS, *AREAS[::-1]],
        "fraction": [area / 100 for area in (*AREAS, *AREAS[::-1])],
    }
)
TOLD = {
    "command": ["coverage", "--radius", "15"],
    "inputs": [{"path": "a", "sha256": "ff"}],
    "options": {"radius": "15"},
    "seeds": {"seed": 7},
    "versions": {"GEOS": "3.13"},
}


def findings(**tables: pd.DataFrame) -> Findings:
    return Findings(
        name="town.gpkg",
        path="here/town.gpkg",
        run_id="0123456789ab",
        crs="EPSG:2157",
        counts={"anchors": 3},
        transit_area_m2=100.0,
        tables=tables,
        columns={"anchors": ["id", "my_own"]},
        metadata={"synthetic": "yes", "provenance coverage": json.dumps(TOLD), "note": "{no json"},
    )


def as_dicts(table) -> list[dict[str, object]]:
    names = [title.name for title in table.headings]
    return [dict(zip(names, row, strict=True)) for row in table.rows]


def test_the_levels_of_a_radius_stand_side_by_side_and_add_up() -> None:
    first, second = as_dicts(sheet(findings(coverage_summary=SUMMARY), "coverage"))
    assert [first[f"level_{level}_m2"] for level in range(4)] == list(AREAS)
    assert [first[f"level_{level}_percent"] for level in range(4)] == list(AREAS)
    assert first["covered_percent"] == pytest.approx(50)
    assert second["covered_percent"] == pytest.approx(95)
    assert (first["device_class"], first["radius_m"]) == ("A", 15)
    assert (second["device_class"], second["radius_m"]) == (None, None)


def test_a_level_that_is_not_in_the_study_is_an_empty_cell() -> None:
    table = sheet(findings(coverage_summary=SUMMARY[SUMMARY["level"] < 3]), "coverage")
    assert as_dicts(table)[0]["level_3_m2"] is None


@pytest.mark.parametrize("name", PARTS)
def test_a_missing_part_is_named_with_the_verb_that_makes_it(name: str) -> None:
    with pytest.raises(FileError) as caught:
        sheet(findings(), name)
    assert caught.value.where == "here/town.gpkg"
    assert caught.value.mend.startswith("covertool ")
    assert caught.value.mend.endswith("--into here/town.gpkg")


def test_a_table_that_does_not_exist_lists_those_that_do() -> None:
    with pytest.raises(OptionError) as caught:
        sheet(findings(), "levels")
    assert all(name in caught.value.mend for name in TABLE_NAMES)


def test_a_study_without_findings_is_refused_and_one_with_some_says_what_it_lacks() -> None:
    with pytest.raises(FileError, match="no findings"):
        sheets(findings())
    made = sheets(findings(coverage_summary=SUMMARY))
    assert [table.name for table in made] == ["summary", "coverage", "parameters", "dictionary"]
    missing = [row for row in made[0].rows if str(row[0]).startswith("not in this study")]
    assert len(missing) == len(PARTS) - 1
    assert set(ALWAYS) <= {table.name for table in made}


def test_the_summary_says_what_is_invented_and_level_3_apart_from_all_covered() -> None:
    rows = {str(row[0]): row for row in sheet(findings(coverage_summary=SUMMARY), "summary").rows}
    assert rows["synthetic"][1] == "yes"
    assert rows["run"][1] == "0123456789ab"
    covered = rows["covered at radius 15 m"]
    assert (covered[1], covered[2]) == (50, "%")
    assert covered[3] == "Level 3 alone: 5.00 %"


def test_parameters_list_every_fact_of_the_provenance() -> None:
    rows = sheet(findings(), "parameters").rows
    assert ("coverage", "command", "", "coverage --radius 15") in rows
    assert ("coverage", "input sha256", "a", "ff") in rows
    assert ("coverage", "option", "radius", "15") in rows
    assert ("coverage", "seed", "seed", "7") in rows
    assert ("coverage", "version", "GEOS", "3.13") in rows
    assert ("study", "metadata", "note", "{no json") in rows


def test_the_dictionary_explains_known_columns_and_lists_the_users_own() -> None:
    rows = sheet(findings(), "dictionary").rows
    assert rows == (("anchors", "id", *meaning("id")), ("anchors", "my_own", "", ""))
    assert meaning("id")[0]


def test_headings_carry_the_unit() -> None:
    assert heading("area_m2").label == "area (m2)"
    assert heading("radius_m").label == "radius (m)"
    assert heading("my_own").label == "my own"


def test_a_plain_table_keeps_its_columns_and_values() -> None:
    table = pd.DataFrame(
        {"arm": ["gps", "proposed"], "mean_error_m": [7.52, np.nan], "samples": [40, 41]}
    )
    made = sheet(findings(positioning=table), "positioning")
    assert [title.name for title in made.headings] == ["arm", "mean_error_m", "samples"]
    assert made.rows == (("gps", 7.52, 40), ("proposed", None, 41))
