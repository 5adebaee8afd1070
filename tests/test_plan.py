"""A plan runs its stages in order, once, and again only where something changed."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from covertool.cli.run import read, verbs
from covertool.errors import CovertoolError, FileError, OptionError
from covertool.plan import Plan, example, run_plan
from covertool.plan.stages import ORDER

PLAN = """
[study]
path = "town.gpkg"
from = "start.gpkg"

[coverage]
radius = [15, 100.5]
penetration = [0.1, 1]

[congestion.table]
observations = "seen.csv"
absent_is_free = true

[[export]]
output = "town.png"

[[export]]
output = "town.pdf"
"""


class Bench:
    """A plan in a folder, run by a stand-in that writes what it was told to write.

    The stand-in takes the place of the verbs, which have tests of their own; here only which of
    them run, in what order and with what words is looked at.
    """

    def __init__(self, folder: Path, text: str = PLAN) -> None:
        self.folder = folder
        self.path = folder / "plan.toml"
        self.path.write_text(text)
        (folder / "start.gpkg").write_bytes(b"a study")
        (folder / "seen.csv").write_text("time\n")
        self.ran: list[tuple[str, ...]] = []
        self.fails = ""

    def plan(self) -> Plan:
        return read(self.path)

    def __call__(self, words: Sequence[str]) -> int:
        self.ran.append(tuple(words))
        if words[0] == self.fails:
            return 1
        target = next(words[i + 1] for i, w in enumerate(words) if w in ("-o", "--into"))
        with (self.folder / target).open("ab") as file:
            file.write(" ".join(words).encode())
        return 0

    def run(self, **options: bool) -> list[str]:
        """Run the plan and return the verbs that ran."""
        self.ran.clear()
        run_plan(self.plan(), self, **options)
        return [words[0] for words in self.ran]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_stages_run_in_the_order_of_the_flow_whatever_the_order_in_the_file(bench: Bench) -> None:
    assert bench.run() == ["congestion", "coverage", "export", "export"]
    assert (bench.folder / "town.gpkg").read_bytes().startswith(b"a study")


def test_keys_become_the_options_of_the_verb(bench: Bench) -> None:
    bench.run()
    assert bench.ran[0] == (
        "congestion", "table", "seen.csv", "--absent-is-free", "--into", "town.gpkg",
    )  # fmt: skip
    assert bench.ran[1] == (
        "coverage", "town.gpkg", "--radius", "15", "--radius", "100.5",
        "--penetration", "0.1,1", "--into", "town.gpkg",
    )  # fmt: skip
    assert bench.ran[2] == ("export", "town.gpkg", "-o", "town.png", "--overwrite")


def test_a_second_run_does_nothing(bench: Bench) -> None:
    bench.run()
    assert bench.run() == []


def test_a_changed_option_runs_its_stage_and_those_that_need_it(bench: Bench) -> None:
    bench.run()
    bench.path.write_text(PLAN.replace("100.5", "400"))
    assert bench.run() == ["coverage", "export", "export"]


def test_a_changed_input_file_runs_its_stage_again(bench: Bench) -> None:
    bench.run()
    (bench.folder / "seen.csv").write_text("time\n2026-01-01\n")
    assert bench.run() == ["congestion", "export", "export"]


def test_a_lost_output_is_made_again(bench: Bench) -> None:
    bench.run()
    (bench.folder / "town.pdf").unlink()
    assert bench.run() == ["export"]


def test_a_study_that_something_else_changed_is_not_written_over(bench: Bench) -> None:
    bench.run()
    study = bench.folder / "town.gpkg"
    study.write_bytes(b"layers drawn by hand")
    with pytest.raises(FileError, match="not as this plan left it"):
        bench.run()
    assert study.read_bytes() == b"layers drawn by hand"
    assert bench.run(overwrite=True) == ["congestion", "coverage", "export", "export"]


def test_a_file_that_is_not_the_plans_own_stays(bench: Bench) -> None:
    (bench.folder / "town.png").write_bytes(b"somebody's picture")
    with pytest.raises(FileError):
        bench.run()
    assert (bench.folder / "town.png").read_bytes() == b"somebody's picture"


def test_a_run_that_broke_off_inside_a_stage_goes_on(bench: Bench) -> None:
    def killed(words: Sequence[str]) -> int:
        if words[0] == "coverage":
            (bench.folder / "town.gpkg").write_bytes(b"written, and then killed")
            raise KeyboardInterrupt
        return bench(words)

    with pytest.raises(KeyboardInterrupt):
        run_plan(bench.plan(), killed)
    assert bench.run() == ["congestion", "coverage", "export", "export"]


def test_a_failing_stage_ends_the_run_and_what_came_before_stays_done(bench: Bench) -> None:
    bench.fails = "coverage"
    assert bench.run() == ["congestion", "coverage"]
    bench.fails = ""
    assert bench.run() == ["coverage", "export", "export"]


def test_a_dry_run_writes_nothing(bench: Bench) -> None:
    outcomes = run_plan(bench.plan(), bench, dry=True)
    assert [outcome.fresh for outcome in outcomes] == [False] * 5
    assert bench.ran == []
    assert sorted(path.name for path in bench.folder.iterdir()) == [
        "plan.toml", "seen.csv", "start.gpkg",
    ]  # fmt: skip


def test_without_a_start_the_first_stage_makes_the_study(tmp_path: Path) -> None:
    bench = Bench(
        tmp_path,
        '[study]\npath = "t.gpkg"\n[coverage]\nanchors = ["a.csv"]\ntransit = "t.geojson"\n'
        '[report]\noutput = "r.html"\n',
    )
    assert bench.run() == ["coverage", "report"]
    assert bench.ran[0][-3:] == ("-o", "t.gpkg", "--overwrite")
    assert "t.gpkg" not in bench.ran[0][:-2]
    assert bench.ran[1] == ("report", "t.gpkg", "-o", "r.html", "--overwrite")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("radius", "radios"), "did you mean radius?"),
        (("[coverage]", "[covrage]"), "did you mean coverage?"),
        (("[congestion.table]", "[congestion.tabel]"), "did you mean congestion.table?"),
        (("absent_is_free = true", "absent_is_free = 1"), "this is a switch"),
        (('path = "town.gpkg"', 'path = "town.shp"'), "a study is a GeoPackage"),
        (("[study]", "[stud]"), "the plan names no study"),
        (('output = "town.pdf"', ""), "add output = FILE"),
        (("radius = [15, 100.5]", "radius = { a = 1 }"), "neither text nor a number"),
        (("[coverage]", "[coverage"), "not TOML"),
        (("radius = [15, 100.5]", "into = 'x.gpkg'"), "there is no key 'into'"),
        (('observations = "seen.csv"', 'observations = "seen*.json"'), "no file fits"),
    ],
)
def test_a_mistake_is_told_with_its_mend(bench: Bench, change: tuple[str, str], told: str) -> None:
    assert change[0] in PLAN
    bench.path.write_text(PLAN.replace(*change))
    with pytest.raises(CovertoolError) as caught:
        bench.plan()
    assert told in str(caught.value)
    assert str(bench.path) in caught.value.where


def test_a_plan_without_stages_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="no stage"):
        Bench(tmp_path, '[study]\npath = "t.gpkg"\n').plan()


def test_the_example_is_a_plan_and_names_only_what_the_verbs_take(tmp_path: Path) -> None:
    plan = Bench(tmp_path, example()).plan()
    assert plan.stages[0].verb == "start"
    assert plan.stages[-1].verb == "report"


def test_every_verb_of_the_flow_exists(tmp_path: Path) -> None:
    assert set(ORDER) <= set(verbs())


def test_what_is_remembered_is_readable(bench: Bench) -> None:
    bench.run()
    remembered = json.loads((bench.folder / "town.gpkg.plan.json").read_text())
    assert set(remembered["outputs"]) == {"town.gpkg", "town.png", "town.pdf"}


def test_a_broken_memory_only_costs_a_second_run(bench: Bench) -> None:
    bench.run()
    (bench.folder / "town.gpkg.plan.json").write_text("{broken")
    with pytest.raises(FileError):
        bench.run()
    assert len(bench.run(overwrite=True)) == 4
