"""The orthophoto of one district and its road mask, drawn with the training renderer's brushes.

The renderer lies in `training/`; run with PYTHONPATH=training.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import zip_longest
from pathlib import Path

import cv2
import numpy as np
import rasterio
import shapely
from rasterio.features import rasterize
from rasterio.transform import from_origin
from renderer import palette
from renderer.buildings import building_shadow, draw_building
from renderer.canvas import Canvas, Pose, Sun, box
from renderer.markings import bay_lines
from renderer.vegetation import draw_bush, draw_hedge, draw_tree, tree_shadow
from renderer.vehicles import draw_car, random_shape

from covertool.model import Vehicles
from data.recipe import carparks, gardens, roofs, skeleton
from data.recipe.curves import frame, heading_deg, left_of, length_m
from data.recipe.layers import ITM
from data.recipe.parameters import ORIGIN_M, TOWN, stream
from data.recipe.plots import Building
from data.recipe.skeleton import Street
from data.recipe.town import Fabric

GSD_M = 0.2
_PX_PER_M = 10
_SIDE_M = 360.0
_CORNER_M = (-620.0, -40.0)
"""Upper left corner of the district, in metres of the drawing."""
_DRIVING_EVERY_M = 45.0
_BUSY_KINDS = ("main", "arterial", "regional", "collector")


def write_orthophoto(folder: Path, fabric: Fabric, cars: Vehicles) -> None:
    """Write orthophoto.tif and road_mask.tif: 360 m square, 0.2 m, EPSG:2157."""
    photo = _District(fabric, cars).draw()
    _write(folder / "orthophoto.tif", np.moveaxis(photo, 2, 0), compress="JPEG")
    _write(folder / "road_mask.tif", _road_mask(fabric)[None], compress="DEFLATE")


def _road_mask(fabric: Fabric) -> np.ndarray:
    """Return 255 where a pixel's centre lies on the carriageway."""
    side = round(_SIDE_M / GSD_M)
    grid = from_origin(*_CORNER_M, GSD_M, GSD_M)
    return rasterize([(fabric.transit, 255)], (side, side), transform=grid, dtype="uint8")


def _write(path: Path, bands: np.ndarray, *, compress: str) -> None:
    colours = {"photometric": "YCBCR", "jpeg_quality": 85} if compress == "JPEG" else {}
    x0, y0 = _CORNER_M[0] + ORIGIN_M[0], _CORNER_M[1] + ORIGIN_M[1]
    profile = {
        "driver": "GTiff", "count": len(bands), "height": bands.shape[1], "width": bands.shape[2],
        "dtype": "uint8", "crs": ITM.to_wkt(), "transform": from_origin(x0, y0, GSD_M, GSD_M),
        "tiled": True, "blockxsize": 256, "blockysize": 256, "compress": compress, **colours,
    }  # fmt: skip
    with rasterio.open(path, "w", **profile) as target:
        target.write(bands)
        target.update_tags(TITLE=f"{TOWN}: drawn, not photographed")


def _to_canvas(points: np.ndarray) -> np.ndarray:
    """Return places of the drawing as metres right and down from the district's corner."""
    return np.column_stack([points[:, 0] - _CORNER_M[0], _CORNER_M[1] - points[:, 1]])


def _stencil(areas: list[shapely.Geometry], px_per_m: int) -> np.ndarray:
    """Return 255 inside polygons (holes left out) and 0 outside."""
    side = round(_SIDE_M * px_per_m)
    stencil = np.zeros((side, side), np.uint8)
    window = shapely.box(*_bounds())
    for part in shapely.get_parts(shapely.intersection(shapely.union_all(areas), window)):
        if part.geom_type == "Polygon":
            rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
            pixels = [np.round(_to_canvas(r) * px_per_m * 16 - 8).astype(np.int32) for r in rings]
            cv2.fillPoly(stencil, pixels, 255, cv2.LINE_8, 4)
    return stencil


def _bounds() -> tuple[float, float, float, float]:
    x0, y1 = _CORNER_M
    return x0, y1 - _SIDE_M, x0 + _SIDE_M, y1


def _waterway(side: int) -> Iterator[tuple[list[shapely.Geometry], np.ndarray]]:
    """Yield the canal with its towpath, and the railway beside it, with their textures."""
    line = shapely.LineString(skeleton.RAILWAY)
    canal, track = line.offset_curve(9.0), line.offset_curve(-8.0)
    gravel = palette.soil(stream("gravel"), side)
    ripples = palette.water(stream("canal"), side)
    murky = palette.hsv(0.20, 0.15, 0.25)
    yield [canal.buffer(8.0)], gravel + 0.50 - gravel.mean()
    yield [canal.buffer(5.5)], ripples - ripples.mean(axis=(0, 1)) + murky
    yield [track.buffer(5.0)], gravel + 0.40 - gravel.mean()
    rails = [track.offset_curve(gap).buffer(0.1) for gap in (-2.5, -1.0, 1.0, 2.5)]
    yield rails, np.full((side, side, 3), 0.62, np.float32)


class _District:
    """The picture under construction, ground first."""

    def __init__(self, fabric: Fabric, cars: Vehicles) -> None:
        self.fabric, self.cars = fabric, cars
        window = shapely.box(*_bounds()).buffer(20.0)
        self.built = [plot for plot in fabric.built if window.contains(shapely.Point(plot.kerb))]
        self.rng = stream("orthophoto")
        self.sun = Sun(np.array([0.55, -0.75]), 0.75, np.zeros(2))
        self.canvas = Canvas(_SIDE_M, _PX_PER_M)
        self.ink = np.array([0.86, 0.86, 0.83], np.float32)

    def draw(self) -> np.ndarray:
        """Return the finished picture, (H, W, 3) uint8 at 0.2 m."""
        self._grass()
        self._paving()
        self._hedges()
        self._markings()
        self._cars()
        tall = self._buildings() + self._trees()
        shade = cv2.GaussianBlur(self.canvas.shade, (0, 0), 1.5)
        self.canvas.image[...] = self.canvas.image * (1 - 0.56 / 255 * shade[..., None])
        for build in tall:
            build()
        return self._photograph()

    def _grass(self) -> None:
        """Lay grass, mown in its own way behind each house, and the canal with the railway."""
        rng = stream("lawns")
        side = self.canvas.image.shape[0]
        self._lay([shapely.box(*_bounds())], 0.18 + palette.green(stream("grass texture"), side))
        for plot in self.built:
            lawn = palette.hsv(rng.uniform(0.16, 0.28), 0.4, rng.uniform(0.25, 0.6))
            self.canvas.polygon(_to_canvas(gardens.rear_garden(plot)), lawn, rng.uniform(0.1, 0.4))
        for areas, texture in _waterway(side):
            self._lay(areas, texture)

    def _paving(self) -> None:
        side = self.canvas.image.shape[0]
        transit = self.fabric.transit
        terraces = [house.outline for house in self.fabric.buildings if house.kind == "terrace"]
        forecourts = shapely.union_all(terraces).buffer(2.0).intersection(transit.buffer(3.0))
        flags = 0.56 + 0.3 * (palette.paving(stream("flags"), side) - 0.6)
        road = palette.asphalt(stream("road texture"), side)
        road += 0.40 - road.mean()
        self._lay(gardens.driveways(self.fabric.drives), flags * 0.95)
        self._lay([transit.buffer(2.0), forecourts], flags)
        self._lay([transit.buffer(0.18)], np.full((side, side, 3), 0.72, np.float32))
        self._lay([carparks.ground(park) for park in skeleton.CAR_PARKS], road * 0.93)
        self._lay([transit], road)

    def _lay(self, areas: list[shapely.Geometry], texture: np.ndarray) -> None:
        """Cover areas of the ground with a texture of 0 to 1."""
        inside = _stencil(areas, _PX_PER_M) > 0
        as_bytes = np.clip(texture * 255, 0, 255).astype(np.uint8)
        np.copyto(self.canvas.image, as_bytes, where=inside[..., None])

    def _hedges(self) -> None:
        rng = stream("hedges")
        houses = [house.outline for house in self.fabric.buildings]
        paved = gardens.driveways(self.fabric.drives)
        taken = shapely.union_all([self.fabric.transit.buffer(2.2), *houses, *paved])
        for hedge in gardens.hedges(self.built, taken):
            line, width = _to_canvas(hedge), rng.uniform(0.7, 1.2)
            self.canvas.line(line, width, palette.hsv(0.25, 0.4, 0.24))
            draw_hedge(self.canvas, line, width, self.sun, rng)

    def _pose(self, x: float, y: float, heading: float) -> Pose:
        place = _to_canvas(np.array([[x, y]]))[0]
        return Pose(float(place[0]), float(place[1]), heading)

    def _markings(self) -> None:
        for x, y, heading in zip(
            self.fabric.lots.x_m, self.fabric.lots.y_m, self.fabric.lots.heading_deg, strict=True
        ):
            pose = self._pose(x, y, heading)
            if self.canvas.in_sight(pose.x_m, pose.y_m, 8.0):
                bay_lines(self.canvas, pose, 5.0, 2.5, stream("bays"), self.ink, end=False)
        for street in self.fabric.streets:
            if street.kind in _BUSY_KINDS:
                for at in np.arange(4.0, length_m(street.points) - 4.0, 8.0):
                    place, along = frame(street.points, float(at))
                    pose = self._pose(place[0], place[1], heading_deg(along))
                    if self.canvas.in_sight(pose.x_m, pose.y_m, 8.0):
                        self.canvas.line(pose.place([[-1.5, 0.0], [1.5, 0.0]]), 0.14, self.ink, 0.9)

    def _cars(self) -> None:
        x, y = self.cars.x_m - ORIGIN_M[0], self.cars.y_m - ORIGIN_M[1]
        sizes = zip(self.cars.length_m, self.cars.width_m, strict=True)
        parked = zip(x, y, self.cars.heading_deg, sizes, strict=True)
        for place_x, place_y, heading, size in parked:
            flip = 180.0 if self.rng.random() < 0.4 else 0.0
            self._car(self._pose(place_x, place_y, heading + flip), size)
        for street in self.fabric.streets:
            if street.kind in (*_BUSY_KINDS, "residential"):
                self._driving(street)

    def _car(self, pose: Pose, size: tuple[float, float] | None) -> None:
        if not self.canvas.in_sight(pose.x_m, pose.y_m, 6.0):
            return
        shape = random_shape(self.rng)
        if size is not None:
            scaled = {**shape.__dict__, "length_m": float(size[0]), "width_m": float(size[1])}
            shape = type(shape)(**scaled)
        draw_car(self.canvas, pose, shape, palette.car_paint(self.rng), self.sun, self.rng)

    def _driving(self, street: Street) -> None:
        """Let a few cars drive, on the left."""
        for at in np.arange(12.0, length_m(street.points) - 12.0, _DRIVING_EVERY_M):
            if self.rng.random() < (0.6 if street.kind in _BUSY_KINDS else 0.12):
                place, along = frame(street.points, float(at + self.rng.uniform(0, 20)))
                way = 1.0 if self.rng.random() < 0.5 else -1.0
                place = place + way * left_of(along) * street.width_m / 4
                self._car(self._pose(place[0], place[1], heading_deg(way * along)), None)

    def _buildings(self) -> list[Callable[[], None]]:
        tall = []
        owners = [plot.street.name for plot in self.fabric.built]
        for building, owner in zip_longest(self.fabric.buildings, owners, fillvalue=None):
            pose, length, depth = self._box(building)
            if self.canvas.in_sight(pose.x_m, pose.y_m, 60.0):
                building_shadow(self.canvas, pose, length, depth, building.height_m, self.sun)
                tall.append(partial(self._roof, building, owner, pose, length, depth))
        return tall

    def _roof(
        self, building: Building, street: str | None, pose: Pose, length: float, depth: float
    ) -> None:
        draw_building(
            self.canvas, pose, length, depth, building.height_m, self.sun, self.rng,
            pitched=street is not None,
        )  # fmt: skip
        if street is None:
            colour = roofs.flat_roof(self.rng)
        else:
            colour = roofs.house_roof(stream(f"roofs of {street}"), self.rng)
        outline = pose.place(box(-length / 2, length / 2, -depth / 2, depth / 2))
        roofs.recolour(self.canvas, outline, colour)

    def _box(self, building: Building) -> tuple[Pose, float, float]:
        corners = np.asarray(building.outline.exterior.coords)[:4]
        sides = corners[1] - corners[0], corners[2] - corners[1]
        lengths = [float(np.hypot(*side)) for side in sides]
        long = int(lengths[1] > lengths[0])
        centre = corners.mean(axis=0)
        pose = self._pose(centre[0], centre[1], heading_deg(sides[long]))
        return pose, lengths[long], lengths[1 - long]

    def _trees(self) -> list[Callable[[], None]]:
        """Plant trees in gardens and parks, clear of streets, walls and cars."""
        rng = stream("trees")
        taken = shapely.union_all(
            [
                self.fabric.transit.buffer(3.0),
                skeleton.railway_strip(),
                *[carparks.ground(park).buffer(1.0) for park in skeleton.CAR_PARKS],
                *[building.outline.buffer(1.5) for building in self.fabric.buildings],
            ]
        )
        x, y = self.cars.x_m - ORIGIN_M[0], self.cars.y_m - ORIGIN_M[1]
        taken = taken.union(shapely.union_all(shapely.points(x, y)).buffer(4.5))
        shapely.prepare(taken)
        x0, y0, x1, y1 = _bounds()
        tall = []
        for _ in range(1100):
            place = np.array([[rng.uniform(x0, x1), rng.uniform(y0, y1)]])
            radius = float(rng.choice([0.8, 1.6, 2.6, 3.8], p=[0.4, 0.3, 0.2, 0.1]))
            if taken.distance(shapely.Point(place[0])) < radius:
                continue
            at = _to_canvas(place)[0]
            if radius < 1.0:
                draw_bush(self.canvas, at[0], at[1], radius, self.sun, rng)
                continue
            args = (self.canvas, at[0], at[1], radius, 2.2 * radius + 1.5, self.sun, rng)
            tree_shadow(*args)
            tall.append(partial(draw_tree, *args))
        return tall

    def _photograph(self) -> np.ndarray:
        """Return the picture as a camera would: blurred, resampled to 0.2 m, with grain."""
        side = round(_SIDE_M / GSD_M)
        soft = cv2.GaussianBlur(self.canvas.image, (0, 0), 0.9)
        small = cv2.resize(soft, (side, side), interpolation=cv2.INTER_AREA).astype(np.float32)
        grain = stream("grain").normal(0.0, 2.2, small.shape)
        return np.clip(small * 1.08 + grain, 0, 255).astype(np.uint8)
