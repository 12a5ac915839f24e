"""`Scene.run`: one run by one of the methods."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..fmu import FmuError, Message, Status, Value
from .common import Common
from .cosimulation import CoSimulation
from .definition import FIXED_STEP, Scene
from .errors import Diverged, SceneError
from .exchange import Exchange
from .network import Network
from .result import SceneResult, audited, kinds
from .sampling import Recorder, Unrecorded, sample_times
from .stepping import DIVERGED


def run(
    scene: Scene,
    *,
    record: bool = True,
    audit: bool = False,
    interval: float | None = None,
    start: float | None = None,
    stop: float | None = None,
    values: Mapping[str, Value] | None = None,
    raw: bool = False,
    **settings,
) -> SceneResult:
    """Run the scene once.

    `record`: sample the recorded variables. `audit`: and all energies. `values`: parameters for every component that has
    them (solver.method ...). `raw`: let a plain exchange run with raw connections of heavy followers. Others: fields of
    `Settings`, for this run; without H that of cs-pece follows the error (rtol, atol).
    """
    chosen = replace(scene.settings, **settings)
    if "H" in settings and "step" not in settings:
        chosen = replace(chosen, step=None)  # for this run H is the step of the common integrator
    samples = sample_times(
        scene.start if start is None else start,
        scene.stop if stop is None else stop,
        scene.interval if interval is None else interval,
    )
    network = Network(
        scene,
        exchange=chosen.method == "common",
        event_mode=chosen.method.startswith("cs"),
        values=values or {},
        alpha=chosen.alpha,
    )
    with network:
        method = _method(network, chosen, raw)
        recorder = Recorder(network, scene.recorded, audit, len(samples)) if record or audit else Unrecorded()
        with np.errstate(over="ignore", invalid="ignore"):
            wall, cpu = _timed(method, network, samples, recorder)
        return _result(scene, chosen.method, network, method, samples, recorder, wall, cpu, _warnings(scene, chosen))


def _method(network: Network, chosen, raw: bool):
    if chosen.method == "common":
        step = chosen.step or chosen.H
        if chosen.integrator in FIXED_STEP and step is None:
            raise SceneError(f"{chosen.integrator} needs a step (step or H)")
        return Common(network, chosen.integrator, step, chosen.rtol, chosen.atol)
    if chosen.H is None and chosen.method != "cs-pece":
        raise SceneError(f"{chosen.method} needs a communication step H")
    if chosen.method in ("jacobi", "seidel"):
        return Exchange(network, chosen.H, chosen.order, chosen.method == "seidel", raw)
    correct = chosen.method == "cs-pece"
    if correct and chosen.order == 0:
        raise SceneError("order = 0: cs-pece has k = 1 or 2")
    return CoSimulation(network, chosen.H, chosen.order, correct, (chosen.rtol, chosen.atol))


def _warnings(scene: Scene, chosen) -> list[Message]:
    """What is allowed but probably not meant."""
    step = (chosen.step or chosen.H) if chosen.method == "common" else chosen.H
    fixed = step is not None and (chosen.method != "common" or chosen.integrator in FIXED_STEP)
    # a step that is 1/alpha by its digits may be a last bit above
    if not (scene.joints and fixed and chosen.alpha * step > 1.0 + 1e-9):
        return []
    text = f"alpha H = {chosen.alpha * step:g} is above 1: the stabilisation is faster than the steps can follow"
    return [Message(Status.WARNING, "scene", text)]


def _timed(method, network: Network, samples: np.ndarray, recorder) -> tuple[float, float]:
    """Wall and CPU time of the loop [s]."""
    method.start(samples, recorder)
    wall, cpu = time.perf_counter_ns(), time.process_time_ns()
    try:
        method.loop(samples, recorder)
    except FmuError as failed:
        # values that have run away are refused by the FMU before they reach the bound here
        if failed.status == Status.DISCARD and (cause := _run_away(network)):
            raise Diverged(network.time, cause) from failed
        raise
    return (time.perf_counter_ns() - wall) * 1e-9, (time.process_time_ns() - cpu) * 1e-9


def _run_away(network: Network) -> str | None:
    """The first coupled output that is no number or beyond every reasonable range."""
    fine = np.abs(network.y) < DIVERGED
    if fine.all():
        return None
    first = int(np.argmin(fine))
    return f"{network.output_name(first)} = {network.y[first]:.3e}"


def _result(scene: Scene, name: str, network: Network, method, samples, recorder, wall, cpu, warnings) -> SceneResult:
    calls = network.counts()
    evaluations = _component_evaluations(network, method)
    recorded = isinstance(recorder, Recorder)
    gaps = recorder.gaps if recorded else np.zeros((0, 2))
    fmus = [component.fmu for component in scene.components.values()]
    connected = {end[0] for connection in scene.connections for end in (connection.source, connection.target)}
    connected |= {end.partition(".")[0] for joint in scene.joints for end in (joint.first, joint.second)}
    return SceneResult(
        t=samples if recorded else samples[:0],
        names=list(recorder.names) if recorded else [],
        values=recorder.values if recorded else np.empty((0, 0)),
        nominal={
            name: scene.norms.get(name, scene.component(ref[0]).fmu.nominal(ref[1]))
            for name, ref in ((name, scene.ref(name)) for name in scene.recorded)
        },
        counts={
            "steps": method.steps,
            "rejected": method.rejected,
            "rhs": method.evaluations,
            "evaluations": evaluations,
            "sweeps": network.sweeps,
            **kinds(calls),
        },
        messages=warnings + [message for instance in network.instances.values() for message in instance.messages],
        method=name,
        calls=calls,
        gap=gaps[:, 0],
        gap_rate=gaps[:, 1],
        energy=audited(recorder.energy_refs, recorder.energies, connected) if recorded else None,
        components=(len(fmus), _archives(fmus) if scene.archived is None else scene.archived),
        variables=(
            len(network.u) + len(network.y),
            sum(len(fmu.names("input")) + len(fmu.names("output")) for fmu in fmus),
        ),
        wall=wall,
        cpu=cpu,
        simulated=float(samples[-1] - samples[0]),
    )


def _component_evaluations(network: Network, method) -> int:
    """Right-hand sides of single components: by the common integrator, or inside by their own solvers."""
    if method.evaluations:
        return method.evaluations * len(network.instances)
    counter = "solver.rhs_evaluations"
    inside = sum(i.get(counter) for i in network.instances.values() if counter in i.fmu.variables)
    # a restored component has forgotten the evaluations of the pass that was discarded
    return round(inside * method.passes)


def _archives(fmus) -> int:
    """Archives beside those in use."""
    folders: set[Path] = {fmu.path.parent for fmu in fmus}
    return len({path for folder in folders for path in folder.glob("*.fmu")})
