"""Entity bombs, deep nesting, gzip bombs, truncation: a clear error, and memory stays bounded."""

import gzip
import os
import subprocess
import sys
import zlib
from datetime import UTC, datetime

import pytest

from covertool.congestion.feeds.protocol import FeedOptions, Limits, feed
from covertool.errors import FileError, TruncatedError
from covertool.gis.streams import open_stream
from covertool.model import Observations
from tests.congestion.feedtools import read

ZERO = datetime(2014, 6, 16, tzinfo=UTC)


def edges(count):
    row = '<edge id="e{}" sampledSeconds="9" speed="5" speedRelative="0.5"/>'
    return "".join(row.format(i) for i in range(count))


def meandata(inner):
    return f'<meandata><interval begin="0" end="900">{inner}</interval></meandata>'


LAUGHS = (
    '<!DOCTYPE m [<!ENTITY a "ha">'
    + "".join(f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 10}">' for i in range(9))
    + "]>"
)


@pytest.mark.parametrize("name", ["sumo", "datex2"])
@pytest.mark.parametrize(
    "text",
    [
        LAUGHS + "<meandata>&j;</meandata>",
        LAUGHS + '<meandata x="&j;"/>',
        '<!DOCTYPE m SYSTEM "http://127.0.0.1:9/x.dtd"><meandata/>',
        '<!DOCTYPE m [<!ENTITY x SYSTEM "file:///etc/hostname">]><meandata>&x;</meandata>',
        "<!DOCTYPE meandata><meandata/>",
    ],
)
def test_entities_and_doctypes_are_refused(name, text):
    with pytest.raises(FileError) as fault:
        read(name, text, time=ZERO)
    assert "ha" * 30 not in str(fault.value)


def test_deep_nesting_is_refused():
    with pytest.raises(FileError, match="deep"):
        read("sumo", "<a>" * 100_000, time=ZERO)


def test_an_endless_record_is_refused():
    endless = "<edge id='e'>" + "<lane/>" * 1000 + "</edge>"
    with pytest.raises(FileError, match="one record"):
        read("sumo", meandata(endless), time=ZERO, limits=Limits(elements=500))


def test_more_records_than_the_cap_are_refused():
    with pytest.raises(FileError, match="more than 10 records"):
        read("sumo", meandata(edges(11)), time=ZERO, limits=Limits(records=10))


@pytest.mark.parametrize("text", ["", "no xml", "\x00\x01\x02", "<a><b></a>", "<a>\x05</a>"])
def test_what_is_no_xml_is_a_file_error(text):
    with pytest.raises(FileError):
        read("sumo", text, time=ZERO)


def test_a_truncated_feed_is_an_error_unless_a_part_is_wanted(caplog):
    cut = meandata(edges(100))[:-700]
    with pytest.raises(TruncatedError, match="ends early"):
        read("sumo", cut, time=ZERO)
    part = read("sumo", cut, time=ZERO, allow_partial=True)
    assert 80 < len(part) < 100
    assert "are kept" in caplog.text


def test_a_truncated_gzip_is_an_error_unless_a_part_is_wanted(tmp_path):
    packed = gzip.compress(meandata(edges(6_000)).encode())
    path = tmp_path / "feed.xml.gz"
    path.write_bytes(packed[: len(packed) // 2])

    def read_path(**options):
        with open_stream(path) as stream:
            parts = feed("sumo").read(stream, FeedOptions(time=ZERO, **options))
            return Observations.concatenate(list(parts))

    with pytest.raises(TruncatedError):
        read_path()
    assert 0 < len(read_path(allow_partial=True)) < 6_000


def test_a_gzip_bomb_is_refused_long_before_it_is_unpacked(tmp_path):
    path = tmp_path / "bomb.xml.gz"
    squeeze = zlib.compressobj(9, zlib.DEFLATED, 31)
    with path.open("wb") as file:
        for _ in range(100):
            file.write(squeeze.compress(b" " * 2**20))
        file.write(squeeze.flush())
    assert path.stat().st_size < 2**20
    with open_stream(path) as stream, pytest.raises(FileError, match="unpacks to more than"):
        list(feed("sumo").read(stream, FeedOptions(time=ZERO)))


def test_a_file_beyond_the_cap_is_refused_while_it_is_read(tmp_path):
    path = tmp_path / "feed.xml"
    path.write_text(meandata(edges(1000)))
    with open_stream(path, max_bytes=10_000) as stream, pytest.raises(FileError, match="unpacks"):
        list(feed("sumo").read(stream, FeedOptions(time=ZERO)))


@pytest.mark.parametrize("content", [b"", b"\x1f\x8b trash that is no gzip"])
def test_an_empty_or_damaged_file_is_a_file_error(tmp_path, content):
    path = tmp_path / "feed.xml"
    path.write_bytes(content)
    with pytest.raises(FileError), open_stream(path) as stream:
        list(feed("sumo").read(stream, FeedOptions(time=ZERO)))


MEMORY = """
import io, re, sys
from pathlib import Path
from covertool.congestion.feeds.protocol import FeedOptions, feed

class Endless(io.RawIOBase):
    def __init__(self, sites):
        self.rows, self.buffer, self.total = self.lines(sites), b"", 0
    def lines(self, sites):
        yield b'<d2LogicalModel xmlns="http://datex2.eu/schema/2/2_0"><payloadPublication>'
        yield b"<publicationTime>2014-06-16T12:00:00Z</publicationTime>"
        for i in range(sites):
            yield (b'<siteMeasurements><measurementSiteReference id="S%d"/><measuredValue>'
                   b"<measuredValue><basicData><trafficStatus><trafficStatusValue>heavy"
                   b"</trafficStatusValue></trafficStatus></basicData></measuredValue>"
                   b"</measuredValue></siteMeasurements>" % (i % 1000))
        yield b"</payloadPublication></d2LogicalModel>"
    def readable(self):
        return True
    def readinto(self, target):
        while len(self.buffer) < len(target):
            row = next(self.rows, None)
            if row is None:
                break
            self.buffer += row
        chunk, self.buffer = self.buffer[:len(target)], self.buffer[len(target):]
        target[:len(chunk)] = chunk
        self.total += len(chunk)
        return len(chunk)

stream = Endless(int(sys.argv[1]))
rows = sum(len(b) for b in feed("datex2").read(io.BufferedReader(stream, 65536), FeedOptions()))
# This process's own peak; ru_maxrss would also count that of the process before exec.
peak = int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) // 1024
print(rows, stream.total, peak)
"""


@pytest.mark.slow
def test_memory_does_not_grow_with_the_feed():
    def run(sites):
        done = subprocess.run(
            [sys.executable, "-c", MEMORY, str(sites)],
            capture_output=True, text=True, check=True, env=dict(os.environ),
        )  # fmt: skip
        rows, size, peak_mib = map(int, done.stdout.split())
        assert rows == sites
        return size, peak_mib

    small_size, small_peak = run(60_000)  # one full batch of rows, and more
    large_size, large_peak = run(180_000)
    assert large_size - small_size > 20 * 2**20
    assert large_peak - small_peak < 12
