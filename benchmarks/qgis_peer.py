"""Buffer, union and intersection as QGIS does them, timed inside QGIS.

Run by the Python that has QGIS, not by the project's own:

    QT_QPA_PLATFORM=offscreen /usr/bin/python3 qgis_peer.py CARS.fgb ROADS.fgb RADIUS

Prints one JSON object: the seconds from loaded layers to the last area, and the area of each level
by counting how often the union repeats a piece.
"""

import json
import sys
import time
from collections import Counter
from pathlib import Path

from qgis.analysis import QgsNativeAlgorithms
from qgis.core import QgsApplication, QgsVectorLayer


def main(cars: str, roads: str, radius_m: str) -> None:
    application = QgsApplication([], False)
    application.initQgis()
    sys.path.append("/usr/share/qgis/python/plugins")
    import processing
    from processing.core.Processing import Processing

    Processing.initialize()
    if "native" not in {provider.id() for provider in application.processingRegistry().providers()}:
        application.processingRegistry().addProvider(QgsNativeAlgorithms())
    places, streets = QgsVectorLayer(cars, "cars", "ogr"), QgsVectorLayer(roads, "roads", "ogr")
    started = time.perf_counter()

    def run(name: str, **given: object) -> QgsVectorLayer:
        # Not into memory: there QGIS refuses the lines in which discs that touch meet.
        made = str(Path(cars).with_name(f"{name}.gpkg"))
        processing.run(f"native:{name}", {"OUTPUT": made, **given})
        return QgsVectorLayer(made, name, "ogr")

    discs = run("buffer", INPUT=places, DISTANCE=float(radius_m), SEGMENTS=16, DISSOLVE=False)
    pieces = run("union", INPUT=discs)
    covered = run("intersection", INPUT=pieces, OVERLAY=streets)
    depth, area = Counter(), {}
    for feature in covered.getFeatures():
        if feature.geometry().area() == 0:
            continue
        inner = feature.geometry().pointOnSurface().asPoint()
        key = (round(inner.x(), 3), round(inner.y(), 3))
        depth[key] += 1
        area[key] = feature.geometry().area()
    levels = [0.0, 0.0, 0.0]
    for key, count in depth.items():
        levels[min(count, 3) - 1] += area[key]
    print(json.dumps({"seconds": time.perf_counter() - started, "areas_m2": levels}))
    sys.stdout.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
