"""Street networks: read from SUMO's nets, made of OSM extracts or of street centre lines."""

from covertool.traffic.edges import Edge, Network
from covertool.traffic.netfile import read_network
from covertool.traffic.osm import network_from_osm
from covertool.traffic.streets import network_from_streets

__all__ = ["Edge", "Network", "network_from_osm", "network_from_streets", "read_network"]
