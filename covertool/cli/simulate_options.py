"""The options of `covertool simulate`, spelled and explained once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

# The traffic.
Net = Annotated[
    Path | None, typer.Option("--net", metavar="FILE", help="SUMO net (.net.xml, .net.xml.gz).")
]
Osm = Annotated[
    Path | None, typer.Option("--osm", metavar="FILE", help="OpenStreetMap extract to drive on.")
]
Fcd = Annotated[
    Path | None,
    typer.Option("--fcd", metavar="FILE", help="A trace in SUMO's names (.csv .xml .parquet)."),
]
NetCrs = Annotated[
    str | None,
    typer.Option("--net-crs", metavar="EPSG:CODE", help="Projection of a net that names none."),
]
DrivingSide = Annotated[
    str | None,
    typer.Option("--driving-side", metavar="left|right", help="With --osm; else by its country."),
]
Scenario = Annotated[
    str | None,
    typer.Option("--scenario", metavar="campus|town", help="Who drives (default: town)."),
]
Routes = Annotated[
    list[Path] | None,
    typer.Option("--routes", metavar="FILE", help="Your own SUMO routes instead (repeatable)."),
]
Horizon = Annotated[
    float | None,
    typer.Option("--horizon", metavar="SECONDS", help="Length of the run (campus 300, else 420)."),
]
TrafficSeed = Annotated[
    list[int] | None,
    typer.Option("--traffic-seed", metavar="N", help="Seed of the traffic, 1 (repeatable)."),
]
AnchorsAs = Annotated[
    str,
    typer.Option(
        "--anchors-as",
        metavar="points|parked",
        help="parked: they stand in SUMO too, and change the traffic.",
    ),
]
Timeout = Annotated[
    float, typer.Option("--timeout", metavar="SECONDS", min=1, help="Stop SUMO after this long.")
]

# The parked cars.
Along = Annotated[
    float | None,
    typer.Option(
        "--along",
        metavar="METRES",
        help="Only anchors this near to the street circuit (15; with --fcd all).",
    ),
]
Unheard = Annotated[
    bool,
    typer.Option("--allow-unheard", help="Go on when no car can ever hear an anchor."),
]
QueueAnchors = Annotated[
    bool,
    typer.Option("--queue-anchors", help="Queued cars on congested segments are anchors too."),
]
Penetration = Annotated[
    float, typer.Option("--penetration", metavar="SHARE", help="Share of anchors equipped, 0 to 1.")
]
Layouts = Annotated[
    int,
    typer.Option(
        "--layouts", metavar="N", min=1, help="Draw N layouts of the parked cars at random."
    ),
]

# The experiment.
Radii = Annotated[
    list[str] | None,
    typer.Option(
        "--radius", metavar="METRES", help="Communication zone (repeatable; 15, campus also 100)."
    ),
]
Arms = Annotated[
    list[str] | None,
    typer.Option(
        "--arm",
        metavar="NAME",
        help="traditional, proposed, gps, gps_odometry (repeatable; default all).",
    ),
]
Estimators = Annotated[
    list[str] | None,
    typer.Option(
        "--estimator",
        metavar="NAME",
        help="gcpso, ekf, second_order or module:Name (repeatable; default the three).",
    ),
]
Preset = Annotated[
    str | None,
    typer.Option("--preset", metavar="paper|best", help="paper: gcpso, ekf; best: second_order."),
]
SigmaRange = Annotated[
    list[float] | None,
    typer.Option(
        "--sigma-range", metavar="METRES", help="Noise of the ranges (repeatable; 0.2 and 4)."
    ),
]
SigmaGps = Annotated[
    float, typer.Option("--sigma-gps", metavar="METRES", help="GPS noise on each axis.")
]
GpsTau = Annotated[
    float,
    typer.Option("--gps-tau", metavar="SECONDS", help="Correlation time of GPS errors; 0: white."),
]
Reading = Annotated[
    list[str] | None,
    typer.Option("--reading", metavar="NAME=VALUE", help="An open point of the paper (below)."),
]
Runs = Annotated[int, typer.Option("--runs", metavar="N", min=1, help="Noise runs.")]
NoiseSeed = Annotated[int, typer.Option("--seed", metavar="N", help="Seed of noise and layouts.")]
Vehicles = Annotated[
    list[str] | None,
    typer.Option(
        "--vehicle", metavar="ID", help="Report this car (repeatable; the five longest routes)."
    ),
]
NoBound = Annotated[bool, typer.Option("--no-bound", help="Leave out the bound (PCRB).")]

# What is written.
ResultTable = Annotated[
    Path | None,
    typer.Option("--table", metavar="FILE", help="All results, one row each (.csv .parquet)."),
]
Traces = Annotated[
    Path | None,
    typer.Option(
        "--traces", metavar="FILE", help="Truth, GPS and estimates by step (.csv .parquet)."
    ),
]
TraceRuns = Annotated[
    int, typer.Option("--trace-runs", metavar="N", min=1, help="Noise runs in --traces.")
]
Additional = Annotated[
    Path | None,
    typer.Option(
        "--additional", metavar="FILE", help="Anchors and coverage for SUMO-GUI (.add.xml)."
    ),
]
FcdOut = Annotated[
    Path | None,
    typer.Option("--fcd-out", metavar="FILE", help="Estimates as SUMO's FCD (.xml)."),
]
EdgeData = Annotated[
    Path | None,
    typer.Option("--edge-data", metavar="FILE", help="SUMO's edgeData of the run (.xml)."),
]
Plot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Error over time by car (.png .svg .pdf)."),
]
PlotDensity = Annotated[
    Path | None,
    typer.Option(
        "--plot-density", metavar="FILE", help="Parked cars met per km against improvement."
    ),
]

READINGS = """\b
Readings of the paper's open points, as --reading NAME=VALUE (the first is the default):
  velocity=previous|current          velocity that carries an estimate on: v(t-1) or v(t)
  sharing=gps|prediction|truth       what a moving neighbour says: its fix, its prediction
  choice=nearest|measured|gdop|all   which three of the neighbours, by priority first
  pseudo_anchor=3|1|2|covariance     anchors used at t-1 that make a pseudo-anchor
  gps_reset_s=10 (campus 1)|none     an isolated car takes its GPS fix every so many seconds;
                                     none: when its own variance exceeds that of GPS
  gps_noise=axis|radial              6 m on each axis, or over both
  sigma_velocity=0.5                 noise of the measured velocity, m/s
  halted=true|false, halted_after_s=5, halted_below=0.1    cars that stand in traffic
  sequential=false|true              cars update one after another
  literal_r, literal_cost=false|true R and the cost as printed
  smoothing=false|true               second_order looks back over the whole trace
  range_growth=0                     deviation of a range per metre (RSSI 4 dB: 0.46)
  nlos_share=0, nlos_mean_m=0        ranges without line of sight
  divergence_m=10000                 an error beyond which a car counts as diverged"""
