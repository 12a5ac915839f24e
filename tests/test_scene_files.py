"""Scene files: SSP 1.0 by its schema and through FMPy's reader, the same byte for byte, and back."""

import shutil
import zipfile

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd
from koppel import library, paths
from koppel.scene import Scene, SceneError
from koppel.scene.ssp import FILE, text

FOLDER = paths.ROOT / "scenes"


@pytest.mark.parametrize("name", library.SCENES)
def test_checked_in_file_is_what_the_library_says(fmu, name):
    """`scripts/scenes` writes them."""
    for file, scene in library.variants(library.scene(name, fmu)).items():
        assert (FOLDER / name / file).read_text(encoding="utf-8") == text(scene), file


def test_every_folder_is_a_scene_of_the_library():
    assert {path.parent.name for path in FOLDER.glob(f"*/{FILE}")} == set(library.SCENES)


@pytest.mark.parametrize("name", library.SCENES)
def test_reading_and_writing_gives_the_same_bytes(fmu, tmp_path, name):
    scene = Scene.read(FOLDER / name, fmu)
    assert scene.write(tmp_path).read_bytes() == (FOLDER / name / FILE).read_bytes()


@pytest.mark.parametrize("name", library.COMPLIANT)
def test_variant_without_joints_runs_by_plain_exchange(fmu, name):
    """Springs of 1e5 or 1e6 N/m in place of the joints: their elongation is below 0.2 mm."""
    scene = Scene.read(FOLDER / name, fmu, variant="foreign.ssd")
    assert not scene.joints and scene.settings.method == "jacobi"
    angle = next(variable for variable in scene.recorded if ".angle.theta" in variable)
    closed = library.scene(name, fmu).run(method="common", integrator="dopri5", stop=1.5)
    difference = np.abs(scene.run(stop=1.5)[angle] - closed[angle]).max()
    assert 1e-7 < difference < 2e-4


def packed(folder, name, file=FOLDER, without=()):
    """The scene as an archive, with the FMUs in use."""
    path = folder / f"{name}.ssp"
    source = (file / name / FILE).read_text(encoding="utf-8")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(FILE, source)
        for fmu in (paths.DIST / "fmi3").glob("*.fmu"):
            if f"resources/{fmu.name}" in source and fmu.stem not in without:
                archive.write(fmu, f"resources/{fmu.name}")
    return path


@pytest.mark.parametrize("name", library.SCENES)
def test_fmpy_reads_it(tmp_path, name):
    """Its reader validates against the schema of SSP 1.0."""
    system = read_ssd(str(packed(tmp_path, name))).system
    with Scene.read(FOLDER / name) as scene:
        assert [element.name for element in system.elements] == list(scene.components)
        assert len(system.connections) == len(scene.connections)


def test_archive_runs_from_what_it_holds(fmu, tmp_path):
    """FMUs in the archive count; the run is that of the library's scene."""
    options = {"integrator": "rk4", "step": 0.05, "stop": 1.0}
    with Scene.read(packed(tmp_path, "double_wishbone"), fmus=tmp_path / "nowhere") as scene:
        values = scene.run(**options).values
    assert (values == library.scene("double_wishbone", fmu).run(**options).values).all()


def test_archive_without_an_fmu(tmp_path):
    path = packed(tmp_path, "double_pendulum", without=("link2",))
    with pytest.raises(SceneError, match=r"no FMU link2.fmu in .*empty"):
        Scene.read(path, fmus=tmp_path / "empty")
    with Scene.read(path) as scene:  # from dist/fmi3
        assert list(scene.components) == ["upper", "lower"]


def edited(tmp_path, name, *replacements):
    source = (FOLDER / name / FILE).read_text(encoding="utf-8")
    for old, new in replacements:
        assert old in source
        source = source.replace(old, new)
    (tmp_path / FILE).write_text(source, encoding="utf-8")
    return tmp_path


def test_version_2_is_read(fmu, tmp_path):
    """SSP 2.0: the same namespaces, `ssc:Float64`, `implementation`."""
    folder = edited(
        tmp_path,
        "double_pendulum",
        ('version="1.0"', 'version="2.0"'),
        ("ssc:Real", "ssc:Float64"),
        ("ssv:Real", "ssv:Float64"),
        (
            'type="application/x-fmu-sharedlibrary"',
            'type="application/x-fmu-sharedlibrary" implementation="CoSimulation"',
        ),
    )
    assert text(Scene.read(folder, fmu)) == (FOLDER / "double_pendulum" / FILE).read_text(encoding="utf-8")


def test_parameters_in_a_file_of_their_own(fmu, tmp_path):
    start, end = "<ssd:ParameterBinding>", "</ssd:ParameterBinding>"
    source = (FOLDER / "double_pendulum" / FILE).read_text(encoding="utf-8")
    inline = source[source.index(start) : source.index(end) + len(end)]
    folder = edited(tmp_path, "double_pendulum", (inline, '<ssd:ParameterBinding source="resources/upper.ssv"/>'))
    inside = inline[inline.index("<ssv:ParameterSet") : inline.index("</ssd:ParameterValues>")].strip()
    namespace = 'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"'
    (tmp_path / "resources").mkdir()
    file = tmp_path / "resources" / "upper.ssv"
    file.write_text(inside.replace("<ssv:ParameterSet", f"<ssv:ParameterSet {namespace}", 1), encoding="utf-8")
    assert text(Scene.read(folder, fmu)) == source
    file.unlink()
    with pytest.raises(SceneError, match=r"has no resources/upper.ssv"):
        Scene.read(folder, fmu)


BAD = {
    "connector": (
        ('endConnector="A.r.x"', 'endConnector="A.q.x"'),
        r"lower \(link2\) has no variable 'A.q.x'; near: .*A.r.x",
    ),
    "element": (('endElement="lower"', 'endElement="lover"'), r"no component 'lover'; near: lower"),
    "setting": (('alpha="', 'beta="'), r"unknown settings beta"),
    "escape": (
        ('source="resources/link2.fmu"', 'source="../../link2.fmu"'),
        r"\.\./\.\./link2.fmu lies outside of the scene",
    ),
    "xml": (("</ssd:System>", ""), r"is no XML"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_file(fmu, tmp_path, case):
    replacement, message = BAD[case]
    with pytest.raises(SceneError, match=message):
        Scene.read(edited(tmp_path, "double_pendulum", replacement), fmu)


def test_missing_file(tmp_path):
    with pytest.raises(SceneError, match=rf"has no {FILE}"):
        Scene.read(tmp_path)
    with pytest.raises(SceneError, match="no archive"):
        Scene.read(tmp_path / "scene.ssp")


def test_settings_and_samples_come_back(fmu, tmp_path):
    scene = library.scene("four_bar", fmu)
    scene.configure(method="cs-pece", order=2, H=5e-3, rtol=1e-7, start=0.0, stop=1.5)
    scene.assemble(["link2.angle.theta"])
    scene.norms["link1.angle.theta"] = 3.0
    shutil.copy(scene.write(tmp_path), tmp_path / "other.ssd")
    back = Scene.read(tmp_path / "other.ssd", fmu)
    for what in (
        "settings",
        "stop",
        "interval",
        "joints",
        "assembled",
        "recorded",
        "norms",
        "reference",
        "connections",
    ):
        assert getattr(back, what) == getattr(scene, what), what
    assert {c.name: c.values for c in back.components.values()} == {c.name: c.values for c in scene.components.values()}


def test_variants_are_other_root_files(fmu, tmp_path):
    scene = library.scene("double_wishbone", fmu, load=False)
    scene.write(tmp_path).rename(tmp_path / "internal.ssd")
    library.scene("double_wishbone", fmu).write(tmp_path)
    assert len(Scene.read(tmp_path, fmu).components) == 4
    assert len(Scene.read(tmp_path, fmu, variant="internal.ssd").components) == 3


def test_only_components_of_the_scene_are_loaded_from_an_archive(fmu, tmp_path):
    """The archive holds every FMU; what the scene does not name is not unpacked, and the report says so."""
    path = packed(tmp_path, "double_pendulum")
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("resources/unused.fmu", b"not even an archive")
    with Scene.read(path) as scene:
        result = scene.run(integrator="rk4", step=0.01, stop=0.1)
    assert result.components == (2, 2)
    assert set(result.calls) == {"upper", "lower"}
