"""Fixtures: the packed FMUs as `scripts/build` leaves them in dist/."""

import pytest
from koppel import Fmu, Loader, paths


@pytest.fixture(scope="session")
def fmu():
    """`fmu(name)`: the packed archive, unpacked once per session. A missing archive fails the test."""
    opened = {}

    def load(name: str) -> Fmu:
        if name not in opened:
            try:
                path = paths.fmu(name)
            except FileNotFoundError as missing:
                pytest.fail(str(missing))
            opened[name] = Fmu(path)
        return opened[name]

    yield load
    for one in opened.values():
        one.close()


@pytest.fixture(scope="session")
def wishbone(fmu) -> Fmu:
    """The double wishbone."""
    return fmu("double_wishbone")


@pytest.fixture(scope="session")
def loader() -> Loader:
    """The compiled loader."""
    try:
        return Loader()
    except FileNotFoundError as missing:
        pytest.fail(str(missing))
