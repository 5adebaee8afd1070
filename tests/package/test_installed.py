"""The built wheel, installed in clean environments, works outside the source tree."""

import json
from pathlib import Path

import pytest

from .conftest import ROOT

pytestmark = pytest.mark.slow
QUICK = ("--estimator", "ekf", "--radius", "15", "--runs", "1", "--no-bound", "--json")


def shares(output: str) -> list[float]:
    levels = json.loads(output)["results"][0]["levels"]
    return [level["fraction"] for level in levels.values()]


def test_the_package_is_the_installed_one(minimal):
    done = minimal.run("-c", "import covertool; print(covertool.__file__)")
    assert Path(done.stdout.strip()).is_relative_to(minimal.folder)
    assert not Path(done.stdout.strip()).is_relative_to(ROOT)


def test_no_requirement_of_the_package_is_broken(minimal):
    done = minimal.run("-m", "pip", "check")
    assert done.returncode == 0, done.stdout


def test_every_module_but_for_the_extras_loads_without_them(minimal):
    code = (
        "import importlib, pkgutil, covertool\n"
        "for module in pkgutil.walk_packages(covertool.__path__, 'covertool.'):\n"
        "    if not module.name.endswith('__main__'):\n"
        "        importlib.import_module(module.name)\n"
    )
    done = minimal.run("-c", code)
    assert done.returncode == 0, done.stderr


def test_coverage_of_the_sample_study_is_found(minimal):
    done = minimal.covertool("coverage", "--radius", "15", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["anchors"] == 4541
    assert sum(shares(done.stdout)) == pytest.approx(1)


def test_the_weights_find_cars_in_the_copied_sample(minimal):
    assert minimal.covertool("sample", "copied").returncode == 0
    words = ("copied/orthophoto.tif", "--mask", "copied/road_mask.tif", "-o", "seen.gpkg")
    done = minimal.covertool("extract", *words, "--json")
    assert done.returncode == 0, done.stderr
    assert (minimal.folder / "work" / "seen.gpkg").is_file()


def test_simulate_takes_the_shipped_trace_and_names_the_extra(minimal):
    done = minimal.covertool("simulate", *QUICK)
    assert done.returncode == 0, done.stderr
    assert "pip install 'covertool[simulate]'" in done.stderr


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        (("simulate", "--scenario", "campus", *QUICK), "simulate"),
        (("coverage", "--radius", "15", "--scheduler", "local"), "scale"),
    ],
)
def test_a_missing_extra_is_named_with_its_mend(minimal, words, extra):
    done = minimal.covertool(*words)
    assert done.returncode == 1
    assert f"mend:  pip install 'covertool[{extra}]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_command_completes_its_verbs_in_a_shell(minimal):
    command = minimal.python.with_name("covertool")
    code = (
        "import os, subprocess\n"
        "words = {'_COVERTOOL_COMPLETE': 'complete_bash', 'COMP_WORDS': 'covertool cov',"
        " 'COMP_CWORD': '1'}\n"
        f"subprocess.run([{str(command)!r}], env=os.environ | words)\n"
    )
    assert minimal.run("-c", code).stdout.split() == ["coverage"]


def test_with_scale_the_tiles_on_dask_give_the_same_areas(minimal, with_extra):
    words = ("coverage", "--radius", "15", "--tile", "400", "--json")
    alone = minimal.covertool(*words)
    spread = with_extra("scale").covertool(*words, "--scheduler", "local", "--workers", "2")
    assert spread.returncode == 0, spread.stderr
    assert shares(spread.stdout) == pytest.approx(shares(alone.stdout), abs=1e-12)


def test_with_simulate_sumo_drives_the_sample_town(with_extra):
    done = with_extra("simulate").covertool("simulate", "--horizon", "60", *QUICK)
    assert done.returncode == 0, done.stderr
    assert "SUMO is not installed" not in done.stderr
    assert json.loads(done.stdout)["command"] == "simulate"
