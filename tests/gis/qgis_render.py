"""Render a GeoPackage in QGIS with the default styles that lie in the file itself.

Run by the Python that has QGIS, not by the project's own:

    QT_QPA_PLATFORM=offscreen /usr/bin/python3 qgis_render.py STUDY.gpkg MAP.png [X0,Y0,X1,Y1]

Areas are drawn first, then lines, then points, each kind in the order of the file; how they look
is what their own style says. Prints one JSON object: for each layer its validity, count, kind of
geometry and colours.
"""

import json
import sys

from qgis.core import (
    QgsApplication,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsProviderRegistry,
    QgsRectangle,
    QgsRenderContext,
    QgsVectorLayer,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor


def main(study: str, picture: str, bounds: "str | None" = None) -> None:
    application = QgsApplication([], False)
    application.initQgis()
    layers = opened(study)
    settings = QgsMapSettings()
    settings.setLayers(layers[::-1])  # QGIS draws the last of these first
    settings.setDestinationCrs(layers[0].crs())
    settings.setBackgroundColor(QColor("white"))
    settings.setOutputSize(QSize(1400, 1000))
    settings.setOutputDpi(96)
    if bounds:
        settings.setExtent(QgsRectangle(*map(float, bounds.split(","))))
    else:
        settings.setExtent(settings.fullExtent())
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    job.renderedImage().save(picture)
    print(json.dumps({"errors": [error.message for error in job.errors()], "layers": told(layers)}))
    sys.stdout.flush()


def opened(study: str) -> list:
    registry = QgsProviderRegistry.instance()
    names = [details.name() for details in registry.querySublayers(study)]
    layers = [QgsVectorLayer(f"{study}|layername={name}", name, "ogr") for name in names]
    spatial = [layer for layer in layers if layer.isSpatial()]
    return sorted(spatial, key=lambda layer: -layer.geometryType())


def told(layers: list) -> list:
    return [
        {
            "name": layer.name(),
            "valid": layer.isValid(),
            "rows": layer.featureCount(),
            "kind": QgsWkbTypes.displayString(layer.wkbType()),
            "crs": layer.crs().authid(),
            "index": layer.hasSpatialIndex() == 2,
            "colours": [
                symbol.color().name() for symbol in layer.renderer().symbols(QgsRenderContext())
            ],
        }
        for layer in layers
    ]


main(*sys.argv[1:])
