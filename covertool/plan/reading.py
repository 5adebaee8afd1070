"""A plan: a TOML file whose tables are verbs and whose keys are the options of these verbs."""

from __future__ import annotations

import difflib
import glob
import tomllib
from collections.abc import Iterable, Mapping
from datetime import date
from pathlib import Path
from typing import Any

from covertool.errors import FileError, OptionError
from covertool.gis.formats import GEOPACKAGE
from covertool.plan.stages import ORDER, START, Parameter, Plan, Stage, Verb

_NEEDS: Mapping[str, tuple[str, ...]] = {
    "congestion table": ("congestion import",),
    "congestion map": ("congestion import",),
    "anchors queue": ("extract", "transit", "anchors parked", "congestion import"),
    "coverage": ("extract", "transit", "anchors parked", "anchors queue"),
    "simulate": ("extract", "transit", "anchors parked", "anchors queue"),
    "export": ORDER[: ORDER.index("export")],
    "report": ORDER[: ORDER.index("export")],
}
"""Verbs whose results a verb reads, beside the stage that makes the study."""

_SET_BY_THE_PLAN = ("study", "into", "overwrite", "json", "help")
_LARGEST_PLAN = 1 << 20


def example() -> str:
    """Return the commented plan of the sample study.

    >>> example().startswith("#")
    True
    """
    return (Path(__file__).parent / "example.toml").read_text(encoding="utf-8")


def read_plan(path: Path, verbs: Mapping[str, Verb], sample: Path) -> Plan:
    """Read a plan; ``sample`` is the study that ``from = "sample"`` names.

    Raises
    ------
    FileError
        When the file is no readable TOML.
    OptionError
        When a table or key is unknown, or a value is of the wrong kind.

    Examples
    --------
    >>> import tempfile
    >>> keys = {"study": "", "radius": "--radius", "into": "--into"}
    >>> verb = Verb("coverage", tuple(Parameter(key, flag) for key, flag in keys.items()))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "plan.toml"
    ...     text = '[study]\\npath = "a.gpkg"\\nfrom = "sample"\\n[coverage]\\nradius = 15\\n'
    ...     _ = path.write_text(text)
    ...     plan = read_plan(path, {"coverage": verb}, Path("sample.gpkg"))
    >>> [stage.name for stage in plan.stages], plan.stages[1].arguments
    (['start', 'coverage'], ('coverage', 'a.gpkg', '--radius', '15'))
    """
    content = _toml(path)
    study, start = _study(content, path, sample)
    stages = [] if start is None else [Stage(START, START, (start,), None, ())]
    tables = dict(_tables(content, verbs, path))
    for verb in ORDER:
        for number, table in enumerate(tables.get(verb, []), start=1):
            name = verb if len(tables[verb]) == 1 else f"{verb} {number}"
            stages.append(_stage(name, verbs[verb], table, stages, study, path))
    if not any(stage.verb != START for stage in stages):
        raise OptionError("the plan has no stage", str(path), f"add a table such as [{ORDER[7]}]")
    return Plan(path.absolute().parent, study, tuple(stages))


def _toml(path: Path) -> dict[str, Any]:
    """Return the content of a plan."""
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST_PLAN + 1)
    except FileNotFoundError:
        raise FileError(
            "the plan does not exist", str(path), f"covertool run --example > {path.name}"
        ) from None
    except OSError as error:
        raise FileError(
            f"the plan cannot be read: {error.strerror}", str(path), "check the path"
        ) from None
    if len(content) > _LARGEST_PLAN:
        raise FileError("this is too large for a plan", str(path), "name a TOML file")
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:  # of which the faults of TOML and UTF-8 are
        raise FileError(
            f"the plan is not TOML: {error}", str(path), "compare it with covertool run --example"
        ) from None


def _study(content: dict[str, Any], path: Path, sample: Path) -> tuple[str, str | None]:
    table = content.pop("study", None)
    if not isinstance(table, dict) or not isinstance(table.get("path"), str):
        raise OptionError("the plan names no study", str(path), '[study] with path = "town.gpkg"')
    unknown = set(table) - {"path", "from"}
    if unknown:
        _refuse_key(sorted(unknown)[0], "study", ("path", "from"), path)
    study, start = table["path"], table.get("from")
    if Path(study).suffix.lower() != GEOPACKAGE.suffixes[0]:
        raise OptionError("a study is a GeoPackage", f"{path}: [study] path", "end it in .gpkg")
    if start is not None and not isinstance(start, str):
        raise OptionError("this is no path", f"{path}: [study] from", 'name a study, or "sample"')
    return study, str(sample) if start == "sample" else start


def _tables(
    content: Mapping[str, Any], verbs: Mapping[str, Verb], path: Path
) -> Iterable[tuple[str, list[dict[str, Any]]]]:
    """Yield each verb of the plan with its tables; ``[anchors.parked]`` is ``anchors parked``."""
    groups = {verb.split()[0] for verb in ORDER if " " in verb}
    for key, value in content.items():
        if key in groups and isinstance(value, dict):
            named = {f"{key} {inner}": table for inner, table in value.items()}
        else:
            named = {key: value}
        for verb, table in named.items():
            if verb not in ORDER or verb not in verbs:
                known = [name.replace(" ", ".") for name in ORDER if name in verbs]
                _refuse_key(verb.replace(" ", "."), None, ("study", *known), path)
            tables = table if isinstance(table, list) else [table]
            if not tables or not all(isinstance(one, dict) for one in tables):
                raise OptionError(f"{verb!r} is no table", str(path), f"write [{verb}]")
            yield verb, tables


def _refuse_key(key: str, table: str | None, known: Iterable[str], path: Path) -> None:
    names = list(known)
    close = difflib.get_close_matches(key, names, n=1)
    where = f"{path}: [{table}]" if table else str(path)
    what = f"there is no key {key!r}" if table else f"there is no stage {key!r}"
    mend = f"did you mean {close[0]}?" if close else f"known here: {', '.join(names)}"
    raise OptionError(what, where, mend)


def _stage(
    name: str,
    verb: Verb,
    table: Mapping[str, Any],
    before: Iterable[Stage],
    study: str,
    path: Path,
) -> Stage:
    """Return the stage that a table of the plan describes."""
    known = {p.key: p for p in verb.parameters if p.key not in _SET_BY_THE_PLAN}
    words: list[str] = []
    options: list[str] = []
    output = None
    for key, value in table.items():
        if key not in known:
            _refuse_key(key, name.replace(" ", "."), known, path)
        where = f"{path}: [{name}] {key}"
        if key == "output":
            output = _text(value, where)
        elif known[key].flag:
            options += _option(known[key], value, where)
        else:
            words += _words(value, path.absolute().parent, where)
    _require_output(name, verb, output, path)
    earlier = list(before)
    if _reads_study(verb, table) and _made(earlier):
        options += ["--study", study] if _flag(verb, "study") else []
        words += [] if _flag(verb, "study") else [study]
    needs = {stage.name for stage in earlier if stage.verb in _NEEDS.get(verb.name, ())}
    needs |= {stage.name for stage in _made(earlier)[:1]}
    arguments = (*verb.name.split(), *words, *options)
    return Stage(
        name, verb.name, arguments, output, tuple(s.name for s in earlier if s.name in needs)
    )


def _made(stages: Iterable[Stage]) -> list[Stage]:
    """Return the stages that write the study, the one that makes it first."""
    return [stage for stage in stages if stage.writes_study]


def _reads_study(verb: Verb, table: Mapping[str, Any]) -> bool:
    """Whether the verb is given the plan's study: not when its inputs are named one by one."""
    return verb.takes("study") and not {"anchors", "net", "osm", "fcd"} & set(table)


def _flag(verb: Verb, key: str) -> str:
    return next((p.flag for p in verb.parameters if p.key == key), "")


def _require_output(name: str, verb: Verb, output: str | None, path: Path) -> None:
    if output is None and not verb.takes("into"):
        raise OptionError(
            "this stage writes a file of its own", f"{path}: [{name}]", "add output = FILE"
        )


def _option(parameter: Parameter, value: Any, where: str) -> list[str]:
    if parameter.is_switch:
        if not isinstance(value, bool):
            raise OptionError("this is a switch", where, "use true or false")
        return [parameter.flag] if value else []
    if isinstance(value, list) and parameter.repeats:
        return [word for one in value for word in (parameter.flag, _text(one, where))]
    if isinstance(value, list):
        return [parameter.flag, ",".join(_text(one, where) for one in value)]
    return [parameter.flag, _text(value, where)]


def _words(value: Any, folder: Path, where: str) -> list[str]:
    """Return the arguments of a verb, with the files that a pattern such as ``*.tif`` finds."""
    words: list[str] = []
    for one in value if isinstance(value, list) else [value]:
        text = _text(one, where)
        if glob.has_magic(text) and not _there(folder / text):
            found = sorted(glob.glob(text, root_dir=folder)) if "\x00" not in text else []
            if not found:
                raise OptionError(f"no file fits {text!r}", where, "check the pattern")
            words += found
        else:
            words.append(text)
    return words


def _there(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # a name that is too long for this disk
        return False


def _text(value: Any, where: str) -> str:
    if isinstance(value, bool) or not isinstance(value, str | int | float | date):
        raise OptionError(
            "this is neither text nor a number", where, "write it as on the command line"
        )
    return str(value)
