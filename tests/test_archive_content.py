"""What an archive holds besides model description and binary: documentation, icon, reference results."""

import struct
import zipfile
import zlib
from posixpath import dirname, join, normpath

import fmpy
import numpy as np
import pytest
from koppel import paths
from koppel.reference_results import folder
from lxml import etree

NAMES = sorted(manifest.parent.name for manifest in (paths.ROOT / "fmus").glob("*/Cargo.toml"))
INDEX = "documentation/index.html"
EXTRA = "extra/org.fmi-standard.fmi-ls-ref"
LAYER = "{http://fmi-standard.org/fmi-ls-manifest}"

every_archive = pytest.mark.parametrize(("name", "fmi"), [(name, fmi) for name in NAMES for fmi in (2, 3)])


def content(name, fmi):
    """Path: bytes of every entry."""
    with zipfile.ZipFile(paths.fmu(name, fmi)) as archive:
        return {entry: archive.read(entry) for entry in archive.namelist()}


def page(name, fmi):
    """The documentation, read strictly: every element closed, every character escaped."""
    return etree.fromstring(content(name, fmi)[INDEX])


def image(png):
    """Width, height and rows of pixels (bytes) of an 8-bit image with alpha, as far as its filters leave them."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, data, width, height = 8, b"", 0, 0
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at : at + 8])
        body = png[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert (depth, colour) == (8, 6)
        if kind == b"IDAT":
            data += body
        at += length + 12
    return width, height, zlib.decompress(data)


# pieces -----------------------------------------------------------------------------------------------------------
@every_archive
def test_every_piece_is_there(name, fmi):
    icons = {2: {"model.png"}, 3: {f"terminalsAndIcons/{file}" for file in ("icon.png", "icon.svg")}}
    wanted = {INDEX, "documentation/fmi-ls-ref.txt", f"{EXTRA}/fmi-ls-manifest.xml", f"{EXTRA}/{name}_ref.csv"}
    entries = content(name, fmi)
    assert not (wanted | icons[fmi]) - set(entries)
    assert not icons[5 - fmi] & set(entries)
    assert all(entries.values()), "an entry is empty"
    foreign = [entry for entry in entries if not entry.startswith(("binaries/", "documentation/", "extra/", "terminals"))]
    assert set(foreign) <= {"modelDescription.xml", "model.png"}


@every_archive
def test_files_of_the_archive_are_those_of_the_model(name, fmi):
    entries = content(name, fmi)
    icon = "model.png" if fmi == 2 else "terminalsAndIcons/icon.png"
    assert entries[icon] == (folder(name) / f"{name}.png").read_bytes()
    assert entries[f"{EXTRA}/{name}_ref.csv"] == (folder(name) / f"{name}.csv").read_bytes()
    inputs = folder(name) / f"{name}_in.csv"
    assert (f"{EXTRA}/{name}_in.csv" in entries) == inputs.exists()


# icons ------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", NAMES)
def test_icon_is_a_drawing(name):
    width, height, pixels = image((folder(name) / f"{name}.png").read_bytes())
    assert width == height == 256
    assert len(set(pixels[1::4])) > 10, "one colour only"
    svg = etree.parse(folder(name) / f"{name}.svg").getroot()
    assert svg.tag == "{http://www.w3.org/2000/svg}svg" and len(svg.findall(".//{*}path")) > 0


@pytest.mark.parametrize("name", NAMES)
def test_icon_fills_the_square_of_its_coordinate_system(name):
    xml = etree.fromstring(content(name, 3)["terminalsAndIcons/terminalsAndIcons.xml"])
    place = xml.find("GraphicalRepresentation")
    system, icon = (place.find(element) for element in ("CoordinateSystem", "Icon"))
    corners = [system.get(corner) for corner in ("x1", "y1", "x2", "y2")]
    assert [icon.get(corner) for corner in ("x1", "y1", "x2", "y2")] == corners
    assert float(corners[2]) - float(corners[0]) == float(corners[3]) - float(corners[1]) > 0.0


# documentation ----------------------------------------------------------------------------------------------------
@every_archive
def test_page_has_all_sections(name, fmi):
    found = page(name, fmi)
    assert found.findtext(".//h1") == name
    titles = ["Model", "Ports", "Parameters", "Inputs", "Outputs", "Local variables", "Reference run"]
    assert [h2.text for h2 in found.iter("h2")] == titles
    written = [h3.text for h3 in found.find(".//section[@id='model']").iter("h3")]
    assert written == ["Equations", "Source", "Safe ranges and limits", "How it was checked"]
    assert found.find(".//section[@id='model']//pre/code") is not None
    assert len(found.findall(".//figure/svg/polyline")) >= 1
    assert len(content(name, fmi)[INDEX]) < 150_000


@every_archive
def test_every_variable_is_in_its_table_with_unit_and_default(name, fmi):
    """The page against the model description: another writer of the same facts."""
    found = page(name, fmi)
    sections = {"parameter": "parameters", "input": "inputs", "output": "outputs", "local": "locals"}
    rows = {}
    for section in sections.values():
        for row in found.findall(f".//section[@id='{section}']//tbody/tr"):
            cells = row.findall("td")
            for place, code in enumerate(cells[0].findall("code")):
                rows[section, code.text] = (place, ["".join(cell.itertext()) for cell in cells])
    description = fmpy.read_model_description(str(paths.fmu(name, fmi)))
    listed = [v for v in description.modelVariables if v.causality in sections]
    assert {(sections[v.causality], v.name) for v in listed} == set(rows)
    for v in listed:
        place, (_, meaning, unit, *rest) = rows[sections[v.causality], v.name]
        assert meaning == v.description
        assert unit == (v.unit or ""), v.name
        if v.causality in ("parameter", "input"):
            default = rest[0].split(", ")[place]
            items = {i.value: i.name for i in v.declaredType.items} if v.type == "Enumeration" else {}
            if v.type == "Boolean":
                assert default == str(v.start).lower()
            else:
                assert items.get(v.start) == default or float(v.start) == float(default), v.name
        if v.causality == "parameter":
            assert rest[2] == ("yes" if v.variability == "tunable" else "no"), v.name


@pytest.mark.parametrize("name", NAMES)
def test_every_port_is_in_the_page(name):
    ports = {code.text for code in page(name, 3).findall(".//section[@id='ports']//tbody/tr/td[1]/code")}
    xml = etree.fromstring(content(name, 3)["terminalsAndIcons/terminalsAndIcons.xml"])
    assert ports == {terminal.get("name") for terminal in xml.iterfind("Terminals/Terminal")} != set()


@every_archive
def test_links_resolve_inside_the_archive(name, fmi):
    entries, found = content(name, fmi), page(name, fmi)
    anchors = {element.get("id") for element in found.iter() if element.get("id")}
    links = [element.get(key) for element in found.iter() for key in ("href", "src") if element.get(key)]
    assert links
    for link in links:
        inside = link[1:] in anchors if link.startswith("#") else normpath(join(dirname(INDEX), link)) in entries
        assert inside, link
    style = found.findtext(".//style")
    assert "url(" not in style and "@import" not in style
    assert not list(found.iter("script", "link", "img", "iframe"))


# reference results ------------------------------------------------------------------------------------------------
@every_archive
def test_manifest_names_files_that_are_there(name, fmi):
    entries = content(name, fmi)
    manifest = etree.fromstring(entries[f"{EXTRA}/fmi-ls-manifest.xml"])
    assert manifest.tag == "fmiReferences"
    assert manifest.get(f"{LAYER}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    assert manifest.get(f"{LAYER}fmi-ls-version") and manifest.get(f"{LAYER}fmi-ls-description")
    related = {normpath(join(EXTRA, r.get("source"))): r.get("role") for r in manifest.iterfind("Related")}
    assert related.keys() <= entries.keys()
    assert {f for f in entries if f.endswith(".csv")} <= related.keys()
    assert related[f"{EXTRA}/{name}_ref.csv"] == "result" and related[INDEX] == "document"


@every_archive
def test_reference_results_hold_every_output_of_the_default_experiment(name, fmi):
    lines = content(name, fmi)[f"{EXTRA}/{name}_ref.csv"].decode().splitlines()
    description = fmpy.read_model_description(str(paths.fmu(name, fmi)))
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    assert lines[0].split(",") == ["time", *outputs]
    values = np.array([line.split(",") for line in lines[1:]], dtype=float)
    experiment = description.defaultExperiment
    assert values[0, 0] == 0.0 and values[-1, 0] == float(experiment.stopTime)
    steps = np.diff(values[:, 0]) / float(experiment.stepSize)
    assert np.abs(steps - np.round(steps)).max() < 1e-6 and steps.min() > 0.5
    assert np.isfinite(values).all() and np.ptp(values[:, 1:], axis=0).max() > 0.0
