"""What can be wrong with a scene or its run."""

from collections.abc import Iterable
from difflib import get_close_matches


class SceneError(ValueError):
    """A scene that is not right, or a run that cannot go on."""


class NotApplicable(SceneError):
    """A method that cannot run this kind of scene."""


class Diverged(SceneError):
    """Exchanged values have left every reasonable range."""

    def __init__(self, time: float, cause: str):
        super().__init__(f"diverged at t = {time:.4f} s: {cause}")
        self.time = time


def near(name: str, known: Iterable[str]) -> str:
    """The known names closest to `name`, for the end of a message."""
    known = list(known)
    close = get_close_matches(name, known, n=4, cutoff=0.5) or known[:8]
    return f"; near: {', '.join(close)}" if close else ""
