"""What `covertool simulate` writes: a study, tables, traces, files for SUMO, figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from covertool.cli.console import say
from covertool.cli.target import Target
from covertool.cli.whence import whence

if TYPE_CHECKING:
    from covertool.cli.simulate_case import Case
    from covertool.cli.simulate_experiment import Experiment
    from covertool.model import PositionTracks
    from covertool.traffic.simulation import Simulation


@dataclass(frozen=True)
class Files:
    """The files that were asked for."""

    target: Target
    table: Path | None
    traces: Path | None
    trace_runs: int
    additional: Path | None
    fcd_out: Path | None
    edge_data: Path | None
    plot: Path | None
    plot_density: Path | None

    def check(self, *, recorded: bool) -> None:
        """Refuse files that may not be written and options that do not fit, at once."""
        from covertool.gis.figure import FIGURE_FORMATS
        from covertool.gis.guard import output_file
        from covertool.gis.records import RECORD_FORMATS
        from covertool.traffic import sumo_files

        if self.target.output is not None and self.target.into is not None:
            raise typer.BadParameter("use -o or --into, not both", param_hint="--into")
        if self.edge_data is not None and recorded:
            raise typer.BadParameter("a recorded trace has no edgeData", param_hint="--edge-data")
        self.target.require_free()
        for path, formats in (
            (self.table, RECORD_FORMATS),
            (self.traces, RECORD_FORMATS),
            (self.additional, sumo_files.ADDITIONAL_FORMATS),
            (self.fcd_out, sumo_files.FCD_FORMATS),
            (self.edge_data, sumo_files.FCD_FORMATS),
            (self.plot, FIGURE_FORMATS),
            (self.plot_density, FIGURE_FORMATS),
        ):
            if path is not None:
                output_file(path, formats, overwrite=self.overwrite)

    @property
    def overwrite(self) -> bool:
        """Whether existing files are replaced."""
        return self.target.overwrite

    def write(self, case: Case, experiment: Experiment, found: Simulation, *, workers: int) -> None:
        """Write all files that were asked for."""
        if self.target.output is not None or self.target.into is not None:
            self._write_layers(case, found)
        self._write_tables(experiment, found, workers)
        self._write_for_sumo(case, experiment, found)
        self._write_figures(case, experiment, found, workers)

    def _write_layers(self, case: Case, found: Simulation) -> None:
        """Write the ways of the cars; a whole new study also holds what they drove among."""
        from covertool.gis.study import inherited_metadata
        from covertool.report.positioning_tables import tables
        from covertool.traffic.trajectories import trajectories

        files = list(case.files)
        metadata = {**inherited_metadata(files), **whence(files).to_metadata()}
        mobility = found.mobilities[0]
        lines = trajectories(mobility.trace, mobility.crs, found.met[0], found.report.cars)
        layers: dict[str, Any] = {"trajectories": lines}
        findings = tables(found.report, found.densities())
        if self.target.output is None:
            layers |= findings
        elif self.target.output.suffix.lower() == ".gpkg":
            layers = {"anchors": found.anchors.to_frame(), **layers, **findings}
            if mobility.network is not None:
                layers["segments"] = mobility.network.to_frame()
        inputs = files if self.target.into is None else []
        self.target.write(layers, metadata, inputs=inputs)

    def _write_tables(self, experiment: Experiment, found: Simulation, workers: int) -> None:
        from covertool.gis.records import write_records
        from covertool.report.positioning_tables import track_frame

        if self.table is not None:
            write_records(self.table, [found.to_frame()], overwrite=self.overwrite)
            say(f"wrote the results to {self.table}")
        if self.traces is not None:
            tracks = _follow(experiment, found, runs=self.trace_runs, workers=workers)
            rows = write_records(self.traces, map(track_frame, tracks), overwrite=self.overwrite)
            say(f"wrote {rows:,} steps to {self.traces}")

    def _write_for_sumo(self, case: Case, experiment: Experiment, found: Simulation) -> None:
        """Write what SUMO-GUI shows, and what SUMO's own tools read."""
        from covertool.traffic.sumo_files import write_additional, write_estimated_fcd

        mobility = found.mobilities[0]
        network, overwrite = mobility.network, self.overwrite
        if self.additional is not None:
            levels = _regions(case, found, experiment.radii_m[0])
            write_additional(
                self.additional, found.anchors, levels, network=network, overwrite=overwrite
            )
            say(f"wrote {len(found.anchors)} anchors and their coverage to {self.additional}")
        if self.fcd_out is not None:
            arm = "proposed" if "proposed" in experiment.arms else experiment.arms[0]
            (tracks,) = _follow(experiment, found, runs=1, workers=1, only=arm)
            write_estimated_fcd(
                self.fcd_out, tracks, mobility.trace, network=network, overwrite=overwrite
            )
            say(f"wrote the estimates of {_case_text(tracks)} to {self.fcd_out}")
        if self.edge_data is not None:
            from covertool.gis.guard import replacing

            with replacing(self.edge_data) as temporary:
                temporary.write_bytes(mobility.edge_data or b"")
            say(f"wrote SUMO's edgeData to {self.edge_data}")

    def _write_figures(
        self, case: Case, experiment: Experiment, found: Simulation, workers: int
    ) -> None:
        """Draw the errors over time, and what parked cars save by their density."""
        from covertool.gis.figure import write_figure

        if self.plot is not None:
            from covertool.report.positioning import error_over_time

            cars = found.vehicles if experiment.vehicles else found.vehicles[:1]
            tracks = _follow(experiment, found, runs=experiment.runs, cars=cars, workers=workers)
            write_figure(self.plot, error_over_time(tracks, cars), overwrite=self.overwrite)
            say(f"wrote {self.plot}")
        if self.plot_density is not None:
            from covertool.report.positioning import density_figure

            synthetic = ", synthetic" if case.synthetic else ""
            layouts = found.report.scenarios
            title = (
                f"{case.kind}{synthetic}, zone {experiment.radii_m[0]:g} m, "
                + (f"{layouts} layouts with " if layouts > 1 else "")
                + f"{found.report.runs} noise runs"
            )
            figure = density_figure(found.densities(), title=title)
            write_figure(self.plot_density, figure, overwrite=self.overwrite)
            say(f"wrote {self.plot_density}")


def _regions(case: Case, found: Simulation, radius_m: float) -> dict[int, Any]:
    """Return the regions of Levels 1 to 3 in the study's transit area, else where cars drove."""
    from covertool.coverage.regions import level_regions
    from covertool.gis.read import read_transit
    from covertool.gis.study import layer_names
    from covertool.traffic.trajectories import driven_area

    mobility = found.mobilities[0]
    if case.study is not None and "transit" in layer_names(case.study):
        transit = read_transit(f"{case.study}:transit", dst_crs=mobility.crs)
    else:
        transit = driven_area(mobility.trace, mobility.crs)
    return dict(level_regions(found.anchors, transit, radius_m))


def _follow(
    experiment: Experiment,
    found: Simulation,
    *,
    runs: int,
    workers: int,
    cars: tuple[str, ...] = (),
    only: str | None = None,
) -> list[PositionTracks]:
    """Return the tracks of each case of the first scenario; with an arm, of its first case."""
    from covertool.traffic.estimates import follow, track_cases

    arms = experiment.arms if only is None else (only,)
    cases = track_cases(arms, experiment.estimators, experiment.sigmas_m, experiment.radii_m)
    if only is not None:
        cases = cases[:1]
    return follow(
        found.scenarios[0], cases, runs=runs, seed=experiment.seed, options=experiment.options,
        vehicles=cars, workers=workers,
    )  # fmt: skip


def _case_text(tracks: PositionTracks) -> str:
    if tracks.estimator is None:
        return tracks.arm
    return (
        f"{tracks.arm}, {tracks.estimator}, range noise {tracks.sigma_range_m:g} m, "
        f"zone {tracks.radius_m:g} m, first run"
    )
