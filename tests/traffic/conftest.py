import pytest

from covertool.traffic.network import network_from_streets
from tests.traffic.towns import SPEC, ladder


@pytest.fixture(scope="session")
def town(tmp_path_factory):
    """A network of a small left-hand town, made by netconvert."""
    if SPEC is None:
        pytest.skip("SUMO is not installed")
    return network_from_streets(ladder(), tmp_path_factory.mktemp("town"))
