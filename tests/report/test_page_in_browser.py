"""The report page in a real browser: headless Chromium switches layers, points, taps and types."""

import base64
import json
import shutil
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from covertool.cli.report import read_parts
from covertool.gis.textfile import HTML, write_text
from covertool.report.page import report_page

webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
from selenium.webdriver.chrome.service import Service  # noqa: E402

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="Chromium and its driver are not installed (apt: chromium)"
)

YELLOW, ORANGE, RED, BLUE = (255, 217, 47), (253, 141, 60), (227, 26, 28), (79, 129, 189)


class Browser:
    """Chromium on one page, without a window."""

    west_m, south_m = 0.0, 0.0

    def __init__(self, page: Path) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(DRIVER))
        self.page = page

    def open(self, width: int = 1280, height: int = 900, *, dark: bool = False) -> None:
        """Load the page on a device of a size that asks for light or dark."""
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        self.scheme("dark" if dark else "light")
        self.driver.get(self.page.as_uri())
        self.wait("document.documentElement.dataset.ready === 'yes'")

    def scheme(self, name: str) -> None:
        asked = {"name": "prefers-color-scheme", "value": name}
        self.send("Emulation.setEmulatedMedia", features=[asked])

    def send(self, command: str, **options: object) -> dict:
        return self.driver.execute_cdp_cmd(command, options)

    def run(self, script: str) -> object:
        return self.driver.execute_script(f"return {script}")

    def wait(self, condition: str, seconds: float = 60.0) -> None:
        until = time.monotonic() + seconds
        while not self.run(condition):
            assert time.monotonic() < until, condition
            time.sleep(0.05)

    def click(self, selector: str) -> None:
        self.run(f"document.querySelector({json.dumps(selector)}).click()")

    def text(self, selector: str) -> str:
        return str(self.run(f"document.querySelector({json.dumps(selector)}).innerText"))

    def at(self, east: float, north: float) -> tuple[float, float]:
        """Return where a place of the town, in metres from the road's corner, is on the screen."""
        middle = "{block: 'center', behavior: 'instant'}"
        self.run(f"document.getElementById('map-box').scrollIntoView({middle})")
        script = """(() => {
            const plot = Bokeh.documents.map((d) => d.get_model_by_name("map")).find((m) => m);
            const box = document.getElementById("map-box").getBoundingClientRect();
            return [plot.x_range.start, plot.x_range.end, plot.y_range.start, plot.y_range.end,
                    box.left + 1, box.top + 1, box.width - 2, box.height - 2];
        })()"""
        left, right, bottom, top, x, y, width, height = self.run(script)
        return (
            x + (10 * (east + self.west_m) - left) / (right - left) * width,
            y + (top - 10 * (north + self.south_m)) / (top - bottom) * height,
        )

    def mouse(self, kind: str, place: tuple[float, float], **more: object) -> None:
        self.send("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], **more)

    def tap(self, place: tuple[float, float]) -> None:
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, place, button="left", buttons=1, clickCount=1)

    def colour(self, place: tuple[float, float]) -> tuple[int, ...]:
        """Return the colour of the screen around a place."""
        picture = base64.b64decode(self.send("Page.captureScreenshot")["data"])
        pixels = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
        x, y = (round(value) for value in place)
        return tuple(int(v) for v in np.median(pixels[y - 1 : y + 2, x - 1 : x + 2], axis=(0, 1)))

    def shows(self, place: tuple[float, float], colour: tuple[int, ...]) -> bool:
        until = time.monotonic() + 15
        while time.monotonic() < until:
            if np.abs(np.subtract(self.colour(place), colour)).max() <= 3:
                return True
            time.sleep(0.2)
        return False

    def faults(self) -> list[str]:
        return [e["message"] for e in self.driver.get_log("browser") if e["level"] == "SEVERE"]

    def requests(self) -> list[str]:
        logged = [json.loads(e["message"])["message"] for e in self.driver.get_log("performance")]
        return [
            entry["params"]["request"]["url"]
            for entry in logged
            if entry["method"] == "Network.requestWillBeSent"
        ]


@pytest.fixture(scope="module")
def page(make_study, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("browser")
    path = folder / "town.html"
    write_text(path, report_page(read_parts(make_study(folder / "town.gpkg"))), HTML)
    return path


@pytest.fixture(scope="module")
def browser(page):
    browser = Browser(page)
    yield browser
    browser.driver.quit()


@pytest.fixture
def fresh(browser) -> Browser:
    """The page as a desktop opens it, with the road's corner found on the map."""
    browser.open()
    # The buildings' shape, known to reach from (150, 120) to (250, 180), gives the map's origin.
    corner = """(() => {
        const plot = Bokeh.documents.map((d) => d.get_model_by_name("map")).find((m) => m);
        const data = plot.renderers.find((r) => r.name === "buildings").data_source.data;
        const column = (name) => (data instanceof Map ? data.get(name) : data[name])[0][0][0];
        return [Math.min(...column("x")), Math.min(...column("y"))];
    })()"""
    x, y = browser.run(corner)
    browser.west_m, browser.south_m = x / 10 - 150, y / 10 - 120
    return browser


def test_the_levels_have_the_papers_colours_and_each_can_be_switched_off(fresh):
    for level, colour, east in ((1, YELLOW, 50), (2, ORANGE, 150), (3, RED, 250)):
        place = fresh.at(east, 35)
        assert fresh.shows(place, colour)
        fresh.click(f"input[value=level{level}]")
        assert not np.array_equal(fresh.colour(fresh.at(east, 35)), colour)
        assert fresh.shows(fresh.at(350, 35), fresh.colour(fresh.at(east, 35)))


def test_another_radius_shows_its_own_levels(fresh):
    assert fresh.shows(fresh.at(75, 35), YELLOW)
    fresh.click("input[name=radius][value='100 m']")
    assert fresh.shows(fresh.at(25, 35), YELLOW)
    assert fresh.shows(fresh.at(75, 35), fresh.colour(fresh.at(350, 35)))


def test_pointing_at_the_map_shows_what_lies_there(fresh):
    fresh.mouse("mouseMoved", fresh.at(250, 35))
    fresh.wait("!document.getElementById('map-tip').hidden")
    told = fresh.text("#map-tip")
    assert "Level 3: three or more" in told
    assert "15 m" in told
    assert "10,000 m²" in told


def test_a_tap_reads_every_layer_there_and_a_name_with_markup_stays_text(fresh):
    fresh.click("input[value=segments]")
    fresh.tap(fresh.at(250, 50))
    fresh.wait("document.querySelectorAll('#map-picked strong').length >= 4")
    told = fresh.text("#map-picked")
    assert told.index("Street segments") < told.index("Level 3") < told.index("Transit area")
    assert told.index("Transit area") < told.index("Zones")
    assert "<script>window.hacked = true</script>" in told
    assert fresh.run("window.hacked === undefined")


def test_after_dark_a_chosen_shape_leaves_the_others_in_their_dark_colours(fresh, browser):
    """The second building lies beside the first, which is chosen."""
    browser.scheme("dark")
    east, other = fresh.at(180, 150), fresh.at(90, 150)
    fresh.wait("getComputedStyle(document.body).backgroundColor === 'rgb(17, 20, 23)'")
    assert fresh.shows(other, (51, 57, 63))
    fresh.tap(east)
    fresh.wait("document.querySelectorAll('#map-picked strong').length >= 1")
    time.sleep(0.5)
    assert fresh.shows(other, (51, 57, 63))


def test_the_keyboard_moves_zooms_and_reads_the_map(fresh):
    span = """(() => {
        const plot = Bokeh.documents.map((d) => d.get_model_by_name("map")).find((m) => m);
        return [plot.x_range.start, plot.x_range.end, plot.y_range.start];
    })()"""
    start = fresh.run(span)
    fresh.run("document.getElementById('map-box').focus()")
    fresh.driver.switch_to.active_element.send_keys("+")
    near = fresh.run(span)
    assert near[1] - near[0] == pytest.approx(0.6 * (start[1] - start[0]))
    fresh.driver.switch_to.active_element.send_keys("\ue014\ue013")  # right, up
    moved = fresh.run(span)
    assert moved[0] > near[0]
    assert moved[2] > near[2]
    fresh.driver.switch_to.active_element.send_keys("0")
    assert fresh.run(span) == start
    fresh.driver.switch_to.active_element.send_keys("\ue007")  # Enter
    assert "click or tap" not in fresh.text("#map-picked").lower()


def test_the_scale_bar_is_as_long_as_it_says(fresh):
    for _ in range(2):
        metres, unit = fresh.text("#scale-text").split()
        pixels = fresh.run("document.getElementById('scale-bar').getBoundingClientRect().width")
        x0, x1 = fresh.at(0, 0)[0], fresh.at(100, 0)[0]
        assert unit == "m"
        assert pixels / (x1 - x0) * 100 == pytest.approx(float(metres), rel=0.02)
        fresh.click("#zoom-in")


def test_no_request_leaves_the_page_and_nothing_fails(fresh, page):
    fresh.click("input[value=trajectories], input[value=congestion-occupied]")
    fresh.mouse("mouseMoved", fresh.at(250, 35))
    asked = [url for url in fresh.requests() if not url.startswith(("data:", "blob:"))]
    assert set(asked) == {page.as_uri()}
    assert fresh.faults() == []


def test_an_injected_script_does_not_run(fresh):
    fresh.run(
        "(() => { const s = document.createElement('script'); s.textContent = 'window.hacked = 1';"
        " document.body.append(s); })()"
    )
    assert fresh.run("window.hacked === undefined")
    assert any("Content Security Policy" in fault for fault in fresh.faults())


def test_a_phone_scrolls_down_but_not_sideways(browser):
    browser.open(390, 844)
    assert browser.run("document.documentElement.scrollWidth") <= 390
    wide = browser.run(
        "[...document.querySelectorAll('.plot, .mapbox, p, h1, h2, figcaption')]"
        ".filter((e) => e.getBoundingClientRect().right > 390.5).length"
    )
    assert wide == 0
    small = browser.run(
        "[...document.querySelectorAll('button')]"
        ".filter((e) => e.getBoundingClientRect().height < 40).length"
    )
    assert small == 0


def test_dark_is_dark_in_the_page_and_in_the_figures_and_follows_the_device(browser):
    browser.open(dark=True)
    plot = (
        "Bokeh.documents.map((d) => d.get_model_by_name('map')).find((m) => m)"
        ".background_fill_color"
    )
    ground = "getComputedStyle(document.body).backgroundColor"
    dark = (browser.run(plot), browser.run(ground))
    browser.scheme("light")
    browser.wait(f"{plot} !== {json.dumps(dark[0])}")
    light = (browser.run(plot), browser.run(ground))
    assert dark[0].startswith("#1")
    assert dark[1] == "rgb(17, 20, 23)"
    assert light[0].startswith("#f")
    assert light[1] == "rgb(251, 250, 247)"


def test_the_tab_key_stops_at_the_map_once_and_at_no_plot(fresh):
    stops = fresh.run(
        """(() => {
            const found = [];
            const walk = (root) => {
                for (const one of root.querySelectorAll("*")) {
                    if (one.tabIndex >= 0) found.push(root.host ? "inner" : one.id || one.tagName);
                    if (one.shadowRoot) walk(one.shadowRoot);
                }
            };
            walk(document);
            return found;
        })()"""
    )
    assert stops.count("map-box") == 1
    assert "inner" not in stops


def test_two_fingers_zoom_the_map(browser):
    browser.open(390, 844)
    browser.send("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
    span = (
        "(() => { const plot = Bokeh.documents.map((d) => d.get_model_by_name('map'))"
        ".find((m) => m); return plot.x_range.end - plot.x_range.start; })()"
    )
    before = browser.run(span)
    x, y = browser.at(0, 0)
    for kind, reach in (("touchStart", 10), ("touchMove", 30), ("touchMove", 60), ("touchEnd", 0)):
        fingers = [{"x": x + 100 - reach, "y": y - 60}, {"x": x + 100 + reach, "y": y - 60}]
        points = fingers if reach else []
        browser.send("Input.dispatchTouchEvent", type=kind, touchPoints=points)
    browser.send("Emulation.setTouchEmulationEnabled", enabled=False)
    browser.wait(f"{span} < {0.8 * before}", 10)


def test_every_plot_is_drawn(fresh):
    sizes = fresh.run(
        "[...document.querySelectorAll('.plot')]"
        ".map((e) => e.firstElementChild.getBoundingClientRect().height)"
    )
    assert len(sizes) == 5
    assert min(sizes) > 80


def test_printing_paints_in_light_and_unfolds_the_figures(browser):
    browser.open(dark=True)
    browser.run("window.dispatchEvent(new Event('beforeprint'))")
    assert browser.run("[...document.querySelectorAll('details')].every((d) => d.open)")
    assert browser.run("document.querySelectorAll('canvas.printed').length") == 6
    painted = browser.run(
        "(() => { const c = document.querySelector('#map .printed');"
        " const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        " return [...new Set(Array.from({length: d.length / 4},"
        " (_, i) => [d[4 * i], d[4 * i + 1], d[4 * i + 2]].join()))]; })()"
    )
    assert {"246,244,239", "216,210,198", "0,0,0"} <= set(painted)  # land, building, car in light
    browser.run("window.dispatchEvent(new Event('afterprint'))")
    assert browser.run("document.querySelectorAll('canvas.printed').length") == 0
    assert browser.send("Page.printToPDF")["data"]
