"""Scenes: FMUs coupled at ports, run by several methods and measured."""

from .definition import INTEGRATORS, METHODS, Component, Connection, Joint, Scene, Settings
from .errors import Diverged, SceneError
from .result import EnergyAudit, SceneResult

__all__ = [
    "INTEGRATORS",
    "METHODS",
    "Component",
    "Connection",
    "Diverged",
    "EnergyAudit",
    "Joint",
    "Scene",
    "SceneError",
    "SceneResult",
    "Settings",
]
