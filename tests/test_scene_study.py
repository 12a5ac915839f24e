"""The study of a scene: kept errors and counts do not get worse, divergence is shown, tables and plots hold everything."""

import copy
import csv
import json

import numpy as np
import pytest
from koppel import Reference, library, scene_study
from koppel.scene import SceneError, plot, study


@pytest.mark.parametrize("name", library.SCENES)
def test_no_scene_is_worse_than_kept(fmu, name):
    """Errors at fixed H up to 20 % larger, orders down by up to 0.3, no more calls. Better on purpose? Keep it anew by
    `python -m koppel.scene_study --keep`."""
    old = json.loads((scene_study.REGRESSION / f"{name}.json").read_text(encoding="utf-8"))
    assert study.worse(old, study.regression(scene_study.kept(name, fmu))) == []


@pytest.mark.parametrize("name", library.SCENES)
def test_no_scene_is_worse_than_kept_in_the_program(name):
    """The same for `koppel study`, all methods with fixed steps."""
    old = json.loads((scene_study.REGRESSION / "native" / f"{name}.json").read_text(encoding="utf-8"))
    assert study.worse(old, study.regression(scene_study.kept_native(name))) == []


KEPT = {
    "rk4": {
        "order": 4.0,
        "points": {
            "0.01": {"e_max": 1e-4, "counts": {"calls": 100, "rejected": 0}, "status": "ok"},
            "0.02": {"e_max": None, "counts": {}, "status": "diverged at t = 1 s"},
        },
    }
}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda new: new["rk4"].update(order=3.69), r"rk4: order 3.69, was 4.00"),
        (lambda new: new["rk4"].update(order=None), r"rk4: order None, was 4.00"),
        (lambda new: new["rk4"]["points"]["0.01"].update(e_max=1.21e-4), r"rk4 at 0.01: e_max 0.000121, was 0.0001"),
        (lambda new: new["rk4"]["points"]["0.01"].update(e_max=float("nan")), r"e_max nan"),
        (lambda new: new["rk4"]["points"]["0.01"]["counts"].update(calls=101), r"rk4 at 0.01: calls 101, was 100"),
        (
            lambda new: new["rk4"]["points"]["0.01"].update(e_max=None, status="diverged"),
            r"rk4 at 0.01: 'diverged', was ok",
        ),
        (lambda new: new["rk4"]["points"]["0.02"].update(e_max=0.1), r"rk4 at 0.02: no longer 'diverged at t = 1 s'"),
        (lambda new: new["rk4"]["points"].pop("0.01"), r"rk4 at 0.01 is missing"),
        (lambda new: new.pop("rk4"), r"rk4 is missing"),
    ],
)
def test_what_is_worse_is_named(change, message):
    new = copy.deepcopy(KEPT)
    assert study.worse(KEPT, new) == []
    change(new)
    (found,) = study.worse(KEPT, new)
    assert message in found


def test_better_is_not_worse():
    new = copy.deepcopy(KEPT)
    new["rk4"]["order"] = 3.71
    new["rk4"]["points"]["0.01"] = {"e_max": 1.19e-4, "counts": {"calls": 99}, "status": "ok"}
    assert study.worse(KEPT, new) == []


def test_study_gives_table_and_plots(fmu, tmp_path):
    scene = library.scene("two_mass", fmu)
    seen = []
    methods = [method for method in study.METHODS if method.name in ("common rk4", "common dopri5", "raw jacobi")]
    points = scene.study(
        steps=(10e-3, 5e-3), tolerances=(1e-4, 1e-6), methods=methods, repeat=2, min_time=0.0, each=seen.append
    )
    assert [(p.method, p.H, p.rtol) for p in points] == [(p.method, p.H, p.rtol) for p in seen] and len(points) == 6
    rk4, raw = points[0], points[-1]
    assert (
        rk4.wall_min <= rk4.wall_median and 0.0 < rk4.cpu and rk4.real_time_factor == pytest.approx(2.0 / rk4.wall_min)
    )
    # of the run that was timed: nothing recorded, two Gets of the leader and one of the follower per sweep
    assert rk4.counts["Get"] == pytest.approx(3 * rk4.counts["sweeps"], abs=3)
    assert raw.status.startswith("diverged at t = 0.") and raw.e_max is None
    study.write_csv(points, tmp_path / "table.csv", {"processor": "this one"})
    lines = (tmp_path / "table.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "# processor: this one"
    rows = list(csv.DictReader(lines[1:]))
    columns = {
        "scene",
        "method",
        "H",
        "rtol",
        "e_max",
        "e_rms",
        "energy",
        "gap",
        "wall_min",
        "wall_median",
        "cpu",
        "status",
    }
    assert columns | {"calls", "doStep", "order"} <= set(rows[0])
    assert [float(row["e_max"] or "nan") for row in rows[:4]] == [p.e_max for p in points[:4]]
    for path in plot.work_precision(points, tmp_path):
        assert path.read_bytes().startswith(b"\x89PNG")


def test_fitted_order_leaves_saturated_points_out():
    at = lambda H, e: study.Point("s", "m", H, None, e, *[None] * 7, {"steps": 1}, None, "ok")
    points = [at(h, h**3) for h in (0.1, 0.05, 0.025)] + [at(1e-5, 1e-13)]
    assert study.fitted_order(points) == pytest.approx(3.0)
    assert study.fitted_order(points[:2]) is None
    assert study.fitted_order([at(h, 2.0) for h in (0.1, 0.05, 0.025)]) is None


def test_methods_that_cannot_run_a_scene_have_one_row(fmu):
    jacobi = [method for method in study.METHODS if method.name == "jacobi order 1"]
    scene = library.scene("four_bar", fmu)
    (point,) = scene.study(steps=(15e-3, 7.5e-3), methods=jacobi, repeat=0)
    assert point.status.startswith("not applicable: four_bar: jacobi and seidel cannot solve closing joints")


def test_computed_reference_agrees_with_the_file(fmu):
    """A scene without a file: dop853 against dopri5 at 1e-12, and both against the solution written separately."""
    scene = library.scene("double_pendulum", fmu)
    of_file = study.reference_of(scene)
    scene.reference = None
    computed = study.reference_of(scene)
    assert np.abs(computed.values - of_file.values).max() <= 1e-9
    scene.reference = "extra/nowhere.csv"
    with pytest.raises(SceneError, match=r"reference extra/nowhere.csv is missing"):
        study.reference_of(scene)


def test_a_scene_without_agreement_has_no_reference(fmu, monkeypatch):
    scene = library.scene("double_pendulum", fmu)
    scene.reference = None
    run = type(scene).run
    loose = lambda self, **options: run(self, **{**options, "rtol": 1e-5, "atol": 1e-5})
    monkeypatch.setattr(type(scene), "run", loose)
    with pytest.raises(SceneError, match=r"double_pendulum has no reference: dop853 and dopri5 at 1e-12 differ by"):
        study.reference_of(scene)


def test_references_of_the_scenes_say_where_they_come_from(fmu):
    for name in library.SCENES:
        reference = study.reference_of(library.scene(name, fmu))
        # our own references have 201 equidistant samples or more, those of other programs what they were given with
        assert isinstance(reference, Reference) and len(reference.t) >= 120
        assert np.allclose(np.diff(reference.t), reference.t[1] - reference.t[0], rtol=0.0, atol=1e-12)
