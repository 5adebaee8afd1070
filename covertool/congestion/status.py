"""One scale for the state of traffic, and the named profiles that map sources to it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from covertool.errors import ColumnError, OptionError
from covertool.model import Floats, Objects

ORDERED = ("free", "slow", "very_slow", "stationary")
"""The scale, from good to bad."""
CLOSED, UNKNOWN = "closed", "unknown"
"""Outside the order: a closed road carries no traffic; of an unknown one nothing is known."""
SCALE = (*ORDERED, CLOSED, UNKNOWN)
SEVERITY = {status: rank for rank, status in enumerate((UNKNOWN, *ORDERED, CLOSED))}
"""Which of two statuses for the same place and time is kept: the one of higher rank."""


@dataclass(frozen=True)
class Profile:
    """How one source's words and relative speeds become the scale's statuses.

    Attributes
    ----------
    name : str
    reference : str
        Where the mapping comes from.
    bands : three floats in (0, 1), falling, or None
        Least relative speed (speed over free-flow speed) of free, slow and very slow.
    words : mapping of the source's words, in lower case, to statuses
    """

    name: str
    reference: str
    bands: tuple[float, float, float] | None = None
    words: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        where = f"status profile {self.name}"
        if self.bands is not None:
            free, slow, very_slow = self.bands
            if not 1 >= free > slow > very_slow > 0:
                raise OptionError(
                    f"the bands {free}, {slow}, {very_slow} do not fall",
                    where,
                    "give the least relative speed of free, slow and very_slow, each below the one"
                    " before, all in (0, 1]",
                )
        wrong = sorted(set(self.words.values()) - set(SCALE))
        if wrong:
            raise OptionError(
                f"{', '.join(wrong)} is not on the scale", where, f"use {', '.join(SCALE)}"
            )


_DATEX_BANDS = (0.75, 0.25, 0.10)

DATEX = Profile(
    "datex",
    "DATEX II v2.3 AbnormalTrafficTypeEnum: below 10 % of the free-flow speed stationary, 10-25 %"
    " queuing, 25-75 % slow",
    bands=_DATEX_BANDS,
)
"""Relative speed: free from 0.75, slow from 0.25, very slow from 0.10 (DATEX II v2.3, definitions
of AbnormalTrafficTypeEnum). The default."""

TOMTOM_TILE = Profile(
    "tomtom-tile",
    "TomTom Traffic API, Raster Flow Tiles, style relative0: 0.75, 0.35, 0.15 of free flow",
    bands=(0.75, 0.35, 0.15),
)
"""Relative speed: free from 0.75, slow from 0.35, very slow from 0.15 (TomTom Traffic API, Raster
Flow Tiles, style ``relative0``)."""

TOMTOM_FEED = Profile(
    "tomtom-feed",
    "TomTom intermediate traffic flow feed: 0.625, 0.35, 0.25 of free flow",
    bands=(0.625, 0.35, 0.25),
)
"""Relative speed: free from 0.625, slow from 0.35, very slow from 0.25 (TomTom's traffic flow
feed, which colours by these shares of the free-flow speed)."""

WAZE = Profile(
    "waze",
    "Waze Data Feed specifications, traffic jams: level 0 free flow to 4 standstill, 5 blocked",
    words={
        "0": "free",
        "1": "free",
        "2": "slow",
        "3": "very_slow",
        "4": "very_slow",
        "5": CLOSED,
    },
)
"""Jam level: 0-1 free, 2 slow, 3-4 very slow, 5 closed (Waze for Cities, Data Feed specifications,
traffic jams). A jam of level 5 has a delay of -1: the road is blocked, nobody stands on it."""

DATEX2_V2 = Profile(
    "datex2-v2",
    "DATEX II v2.3 TrafficStatusEnum and AbnormalTrafficTypeEnum",
    bands=_DATEX_BANDS,
    words={
        "freeflow": "free",
        "heavy": "slow",
        "congested": "very_slow",
        "impossible": "stationary",
        "stationarytraffic": "stationary",
        "queuingtraffic": "very_slow",
        "slowtraffic": "slow",
        "heavytraffic": "free",
    },
)
"""TrafficStatus: freeFlow free, heavy slow, congested very slow, impossible ("effectively at a
standstill") stationary. AbnormalTraffic: stationaryTraffic (below 10 % of free flow),
queuingTraffic (10-25 %), slowTraffic (25-75 %), heavyTraffic (75-90 %: free on this scale). Words
and percentages are those of the schema's own definitions, DATEX II v2.3. In v3 the word ``heavy``
alone means the last of these, so v3 needs a profile of its own."""

PROFILES: dict[str, Profile] = {
    profile.name: profile for profile in (DATEX, TOMTOM_TILE, TOMTOM_FEED, WAZE, DATEX2_V2)
}
SPEED_PROFILES = (DATEX, TOMTOM_TILE, TOMTOM_FEED)


def profile_named(name: str) -> Profile:
    """Return a profile that covertool knows by name.

    Raises
    ------
    OptionError
        When there is none of that name.

    Examples
    --------
    >>> profile_named("tomtom-tile").bands
    (0.75, 0.35, 0.15)
    """
    try:
        return PROFILES[name]
    except KeyError:
        raise OptionError(
            f"there is no status profile {name!r}",
            "--profile",
            f"use one of {', '.join(PROFILES)}, or the path of a TOML file of your own",
        ) from None


def parse_profile(text: str, where: str = "profile file") -> Profile:
    """Return the profile that a user's TOML text describes.

    Keys: ``name``, ``reference``, a table ``bands`` with ``free``, ``slow``, ``very_slow`` (least
    relative speeds), and a table ``words`` of word = status.

    Raises
    ------
    OptionError
        When the text is not TOML, has an unknown key, or maps to something off the scale.

    Examples
    --------
    >>> mine = parse_profile('name = "city"\\n[words]\\nheavy = "slow"')
    >>> status_of_words(np.array(["Heavy", "free"], dtype=object), mine).tolist()
    ['slow', 'free']
    """
    shape = "use the keys name, reference, [bands] free, slow, very_slow, and [words]"
    try:
        content = tomllib.loads(text)
        unknown = set(content) - {"name", "reference", "bands", "words"}
        if unknown:
            raise OptionError(f"unknown keys {sorted(unknown)}", where, shape)
        bands = content.get("bands")
        return Profile(
            str(content.get("name", where)),
            str(content.get("reference", "the user's own")),
            None if bands is None else tuple(float(bands[key]) for key in ORDERED[:3]),  # type: ignore[arg-type]
            {str(k).lower(): str(v) for k, v in content.get("words", {}).items()},
        )
    except (tomllib.TOMLDecodeError, KeyError, TypeError, ValueError, AttributeError) as fault:
        raise OptionError(f"the status profile cannot be read: {fault}", where, shape) from None


def status_of_speed(relative_speed: Floats, profile: Profile = DATEX) -> Objects:
    """Return the status of each relative speed; NaN and negative values are unknown.

    Parameters
    ----------
    relative_speed : (N,) array
        Speed over free-flow speed.
    profile : Profile
        One that has bands.

    Examples
    --------
    >>> status_of_speed(np.array([1.0, 0.75, 0.7499, 0.1, 0.0, np.nan])).tolist()
    ['free', 'free', 'slow', 'very_slow', 'stationary', 'unknown']
    """
    if profile.bands is None:
        raise OptionError(
            f"the status profile {profile.name} has no bands of relative speed",
            "--profile",
            f"use one of {', '.join(p.name for p in SPEED_PROFILES)}",
        )
    relative = np.asarray(relative_speed, dtype=float)
    # From the top: free where >= bands[0]; each band that is missed is one step worse.
    steps = np.sum([~(relative >= least) for least in profile.bands], axis=0)
    status: Objects = np.array(ORDERED, dtype=object)[steps]
    status[~(relative >= 0)] = UNKNOWN
    return status


def status_of_words(words: Objects, profile: Profile | None = None) -> Objects:
    """Return the status of each word: the scale's own, or those of a profile.

    Missing and empty words are unknown.

    Raises
    ------
    ColumnError
        For a word that neither the scale nor the profile knows: ``heavy`` means one thing in
        DATEX II v2 and another in v3, so it is not guessed.

    Examples
    --------
    >>> status_of_words(np.array(["slow", None, "closed"], dtype=object)).tolist()
    ['slow', 'unknown', 'closed']
    """
    known: dict[str, str] = {status: status for status in SCALE} | {"": UNKNOWN}
    if profile is not None:
        known |= profile.words
    distinct = {word: _normal(word) for word in set(words.tolist())}
    strange = sorted({str(word) for word, normal in distinct.items() if normal not in known})
    if strange:
        raise ColumnError(
            f"the status {', '.join(repr(w) for w in strange[:5])} is not on the scale",
            "column status" + (f", profile {profile.name}" if profile else ""),
            f"name the profile that explains it with --profile; the scale is {', '.join(SCALE)}",
        )
    return np.array([known[distinct[word]] for word in words.tolist()], dtype=object)


def status_of_word(word: str | None, profile: Profile | None = None) -> str:
    """Return the status of one word; see `status_of_words`.

    >>> status_of_word("congested", DATEX2_V2)
    'very_slow'
    """
    return str(status_of_words(np.array([word], dtype=object), profile)[0])


def _normal(word: object) -> str:
    if word is None or word != word:  # None and NaN
        return ""
    return str(word).strip().lower()
