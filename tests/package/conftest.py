"""The distributions, built once, and clean environments that they are installed in."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PINS = ["--constraint", str(ROOT / "constraints.txt")]
NOT_SOURCE = (".git", ".venv", ".*_cache", ".hypothesis", "__pycache__", "out", "dist", "_build")


def build(source: Path, out: Path, *kinds: str) -> dict[str, Path]:
    """Build distributions of a source tree; return them by extension."""
    command = [sys.executable, "-m", "build", "--no-isolation", *kinds, "-o", str(out), str(source)]
    stamped = os.environ | {"SOURCE_DATE_EPOCH": "1700000000"}
    subprocess.run(command, check=True, capture_output=True, env=stamped)
    return {path.suffix: path for path in out.iterdir()}


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the wheel and the sdist, each made straight from one state of the source tree."""
    copied = tmp_path_factory.mktemp("tree") / "covertool"
    shutil.copytree(ROOT, copied, ignore=shutil.ignore_patterns(*NOT_SOURCE))
    return build(copied, tmp_path_factory.mktemp("dist"), "--wheel", "--sdist")


class Environment:
    """A virtual environment outside the source tree."""

    def __init__(self, folder: Path, beside: "Environment | None" = None) -> None:
        venv.create(folder, with_pip=True)
        self.python = folder / "bin" / "python"
        self.folder = folder
        if beside is not None:
            packages = beside.folder / packages_below(beside.folder)
            (folder / packages_below(folder) / "beside.pth").write_text(f"{packages}\n")

    def install(self, *requirements: str) -> None:
        """Install with the pinned versions."""
        command = [self.python, "-m", "pip", "install", "--quiet", *PINS, *requirements]
        subprocess.run(command, check=True, cwd=self.folder)

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run Python in a folder of its own, with nothing of the source tree on its path."""
        work = self.folder / "work"
        work.mkdir(exist_ok=True)
        plain = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "COV"))}
        return subprocess.run(
            [self.python, *words], cwd=work, capture_output=True, text=True, check=False, env=plain
        )

    def covertool(self, *words: str) -> subprocess.CompletedProcess[str]:
        return self.run("-m", "covertool", *words)


def packages_below(folder: Path) -> str:
    places = {"base": str(folder), "platbase": str(folder)}
    return sysconfig.get_path("purelib", "venv", vars=places)


@pytest.fixture(scope="session")
def minimal(built: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """Return an environment that holds the wheel and no extra."""
    fresh = Environment(tmp_path_factory.mktemp("minimal"))
    reach = [fresh.python, "-m", "pip", "download", "-q", "--no-deps", *PINS, "affine"]
    if subprocess.run(reach, cwd=fresh.folder, check=False, capture_output=True).returncode:
        pytest.skip("no package index can be reached")
    fresh.install(str(built[".whl"]))
    return fresh


@pytest.fixture(scope="session")
def with_extra(minimal: Environment, built: dict[str, Path], tmp_path_factory):
    """Return a way to get an environment with the minimal packages and those of one extra."""

    def extended(extra: str) -> Environment:
        fresh = Environment(tmp_path_factory.mktemp(extra), beside=minimal)
        fresh.install(f"covertool[{extra}] @ {built['.whl'].as_uri()}")
        return fresh

    return extended
