"""The shell of the command: start-up, help, exit codes."""

import subprocess
import sys

from tests.running import run

HEAVY = {"geopandas", "rasterio", "cv2", "numba", "pandas", "scipy", "shapely", "pyproj", "dask"}


def test_help_imports_none_of_the_heavy_libraries():
    code = (
        "import sys; from covertool.cli.main import main; code = main(['--help']);"
        "print(sorted(m for m in sys.modules if '.' not in m), file=sys.stderr); sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(eval(done.stderr.splitlines()[-1]))
    assert "typer" in loaded
    assert not loaded & HEAVY


def test_help_starts_with_whole_examples():
    done = run("--help")
    assert done.returncode == 0
    assert done.stdout.index("covertool coverage --radius 15") < done.stdout.index("Options")


def test_an_unknown_verb_is_a_usage_error():
    done = run("cover")
    assert done.returncode == 2
    assert done.stdout == ""


def test_the_version_is_the_package_version():
    from covertool import __version__

    assert run("--version").stdout.strip() == f"covertool {__version__}"
