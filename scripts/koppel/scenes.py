"""Start values of the double wishbone's scenes, by the FMU's variable names. The FMU's defaults are `wishbone_paper`."""

GRAVITY = -9.80665

PAPER: dict = {}

ROAD = {
    "gravity.z": GRAVITY,
    "strut.preload_mode": "static",
    "static_load.z": 3500.0,
    "force.offset.z": 3500.0,
    "force.amplitude.z": 0.0,
    "force.pulse.amplitude.x": -300.0,
    "force.pulse.amplitude.z": 800.0,
    "force.pulse.start": 0.5,
    "force.pulse.duration": 0.08,
}

SPATIAL = {
    "scene.motion": "spatial",
    "use.tie": True,
    "gravity.z": GRAVITY,
    "strut.preload_mode": "static",
    "force.amplitude.y": 100.0,
    "force.amplitude.z": 200.0,
    "force.omega.y": 8.0,
    "force.omega.z": 13.0,
}

DROP = {"strut.c": 0.0, "gravity.z": GRAVITY, "force.amplitude.z": 0.0}

TINY = {"upper.mass": 2.5e-3, "upper.inertia.xx": 1e-6}

LOAD200 = {"force.amplitude.z": 200.0}


def bushing(k: float, c: float) -> dict:
    """LOAD200 with the upper link held by a spring-damper at D."""
    return {**LOAD200, "closure.kind": "bushing", "closure.k": k, "closure.c": c}


def fixed(method: str, step: float) -> dict:
    """A method with fixed inner steps."""
    return {"solver.method": method, "solver.step": step}


def atol_of(rtol: float) -> float:
    """atol = rtol / 1000: angles and rates of these scenes are 1e-2 to 1, so rtol decides."""
    return float(f"{rtol / 1000.0:.6g}")


def adaptive(method: str, rtol: float) -> dict:
    """A method with step-size control."""
    return {"solver.method": method, "solver.rtol": rtol, "solver.atol": atol_of(rtol)}
