"""Detectors of cars in top-view imagery, behind one protocol."""

from __future__ import annotations

from covertool.extract.detectors.protocol import Detector

NAMES = ("network", "classical")
"""Detectors that ship; the first is the default."""


def default_detector(*, tta: bool | None = None) -> Detector:
    """Return the best detector that ships: the network, else the hand-made one.

    Parameters
    ----------
    tta : bool, optional
        Look at each picture four ways round and average: better, at four times the work. The
        network does so unless told not to; the hand-made one cannot.

    Examples
    --------
    >>> default_detector().gsd_m
    0.2
    """
    return named_detector("network" if _network_ships() else "classical", tta=tta)


def named_detector(name: str, *, tta: bool | None = None) -> Detector:
    """Return a shipped detector by its name; ``tta`` as for :func:`default_detector`.

    Raises
    ------
    OptionError
        When the name is none of ``NAMES``, or ``tta`` is asked of the hand-made one.
    """
    from covertool.errors import OptionError

    if name == "network":
        from covertool.extract.detectors.network import NetworkDetector

        return NetworkDetector.shipped(tta=tta is not False)
    if name != "classical":
        raise OptionError(f"there is no detector {name!r}", "--detector", f"use {NAMES[0]}")
    if tta:
        raise OptionError("the classical detector has no --tta", "--tta", "leave it out")
    from covertool.extract.detectors.classical import ClassicalDetector

    return ClassicalDetector()


def _network_ships() -> bool:
    from importlib import resources

    from covertool.extract.detectors.network import CARD, WEIGHTS

    folder = resources.files(__package__)
    return (folder / WEIGHTS).is_file() and (folder / CARD).is_file()
