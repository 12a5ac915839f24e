"""Run the project's FMUs through fmpy and measure their error against their run time.

Shared by `scripts/demo` and the tests. The package is not installed: `scripts/lib.sh` puts `scripts/` on PYTHONPATH, and
`tests/pytest.ini` does the same for a plain `pytest`.
"""

from .fmu import Fmu, FmuError, Instance, Message, Result, Status
from .loader import Loader, LoaderError, Timing
from .reference import BadReference, Reference

__all__ = [
    "Fmu",
    "FmuError",
    "Instance",
    "Loader",
    "LoaderError",
    "Message",
    "Reference",
    "BadReference",
    "Result",
    "Status",
    "Timing",
]
