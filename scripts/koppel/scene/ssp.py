"""Scene files: `SystemStructure.ssd` of SSP 1.0, alone in a folder or in an `.ssp` archive.

What SSP has no word for (method, closing joints, samples) is an annotation of the system, type `org.fmu-suite.scene`.
Written files are the same byte for byte for the same scene.
"""

import tempfile
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import fields
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from ..fmu import Fmu, Value
from .definition import Component, Connection, Ref, Scene, Settings
from .errors import SceneError

FILE = "SystemStructure.ssd"
#: Name of the parameter sets.
SET = "start"
NAMESPACES = {
    "xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "xmlns:ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
}
ANNOTATION, ANNOTATION_NAMESPACE = "org.fmu-suite.scene", "http://org.fmu-suite/scene"
#: SSP 1.0 type of an FMI 3.0 type.
TYPES = {"Float64": "Real", "Int32": "Integer", "Int64": "Integer", "Boolean": "Boolean", "String": "String"}
TYPES |= {"Enumeration": "Enumeration"}


# writing ------------------------------------------------------------------------------------------------------------
class _Element:
    """An element with its attributes (None: left out) and children."""

    def __init__(self, tag: str, attributes: dict[str, object] | None = None, children: Iterable["_Element"] = ()):
        self.tag, self.attributes, self.children = tag, attributes or {}, list(children)

    def lines(self, indent: str = "") -> Iterator[str]:
        """The element as text."""
        given = {name: value for name, value in self.attributes.items() if value is not None}
        head = self.tag + "".join(f" {name}={quoteattr(_text(value))}" for name, value in given.items())
        if not self.children:
            yield f"{indent}<{head}/>"
            return
        yield f"{indent}<{head}>"
        for child in self.children:
            yield from child.lines(indent + "  ")
        yield f"{indent}</{self.tag}>"


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(float(value)) if isinstance(value, float) else str(value)


def text(scene: Scene) -> str:
    """The scene as an SSD document."""
    components = list(scene.components.values())
    system = _Element(
        "ssd:System",
        {"name": scene.name},
        [
            _Element("ssd:Elements", None, [_component(scene, component) for component in components]),
            *([_Element("ssd:Connections", None, map(_connection, scene.connections))] if scene.connections else []),
            _Element("ssd:Annotations", None, [_annotation(scene)]),
        ],
    )
    experiment = _Element("ssd:DefaultExperiment", {"startTime": scene.start, "stopTime": scene.stop})
    root = _Element(
        "ssd:SystemStructureDescription",
        NAMESPACES | {"version": "1.0", "name": scene.name},
        [system, *_enumerations(scene), *_units(scene), experiment],
    )
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + "\n".join(root.lines()) + "\n"


def write(scene: Scene, folder: str | Path) -> Path:
    """Write the scene into the folder, which is made if needed."""
    path = Path(folder) / FILE
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text(scene), encoding="utf-8")
    return path


def _used(scene: Scene, component: Component) -> list[str]:
    """Variables that are connected, recorded, assembled, closed by a joint, or have a value; in the FMU's order."""
    refs: set[Ref] = {end for c in scene.connections for end in (c.source, c.target)}
    refs |= {scene.ref(name) for name in (*scene.recorded, *scene.assembled)}
    used = {variable for name, variable in refs if name == component.name} | set(component.values)
    return [name for name in component.fmu.variables if name in used]


def _component(scene: Scene, component: Component) -> _Element:
    variables = component.fmu.variables
    connectors = [_connector(variables[name]) for name in _used(scene, component)]
    children = [_Element("ssd:Connectors", None, connectors)] if connectors else []
    if component.values:
        ordered = [name for name in variables if name in component.values]
        parameters = [_parameter(component, name) for name in ordered]
        inside = [_Element("ssv:Parameters", None, parameters)]
        # one name for all: hosts that apply parameter sets by name apply the whole scene's
        parameter_set = _Element("ssv:ParameterSet", {"version": "1.0", "name": SET}, inside)
        for tag in ("ssd:ParameterValues", "ssd:ParameterBinding", "ssd:ParameterBindings"):
            parameter_set = _Element(tag, None, [parameter_set])
        children.append(parameter_set)
    attributes = {
        "name": component.name,
        "type": "application/x-fmu-sharedlibrary",
        "source": f"resources/{component.archive}.fmu",
    }
    return _Element("ssd:Component", attributes, children)


def _connector(variable) -> _Element:
    kind = variable.causality if variable.causality in ("input", "output") else "parameter"
    tag = TYPES[variable.type]
    attributes = {"unit": variable.unit} if tag == "Real" else {}
    if tag == "Enumeration":
        attributes = {"name": variable.declaredType.name}
    return _Element("ssd:Connector", {"name": variable.name, "kind": kind}, [_Element(f"ssc:{tag}", attributes)])


def _parameter(component: Component, name: str) -> _Element:
    value, variable = component.values[name], component.fmu.variable(name)
    tag = TYPES[variable.type]
    convert = {"Real": float, "Integer": int, "Boolean": bool, "String": str}
    value = component.fmu.item(name, value) if tag == "Enumeration" else convert[tag](value)
    return _Element("ssv:Parameter", {"name": name}, [_Element(f"ssv:{tag}", {"value": value})])


def _connection(connection: Connection) -> _Element:
    (from_name, output), (to_name, input_) = connection.source, connection.target
    attributes = {
        "startElement": from_name,
        "startConnector": output,
        "endElement": to_name,
        "endConnector": input_,
    }
    transformed = (connection.factor, connection.offset) != (1.0, 0.0)
    transformation = {"factor": connection.factor, "offset": connection.offset}
    children = [_Element("ssc:LinearTransformation", transformation)] if transformed else []
    return _Element("ssd:Connection", attributes, children)


def _annotation(scene: Scene) -> _Element:
    blank = lambda value: "" if value is None else value
    settings = {f.name: blank(getattr(scene.settings, f.name)) for f in fields(Settings)}
    inside = [_Element("joint", {"first": joint.first, "second": joint.second}) for joint in scene.joints]
    if scene.assembled:
        inside.append(_Element("assemble", {"variables": " ".join(scene.assembled)}))
    if scene.recorded:
        record = {"variables": " ".join(scene.recorded), "interval": blank(scene.interval)}
        inside.append(_Element("record", record))
    if scene.reference:
        inside.append(_Element("reference", {"file": scene.reference}))
    inside += [_Element("norm", {"variable": name, "value": value}) for name, value in scene.norms.items()]
    # the schema allows one element in an annotation
    whole = _Element("scene", {"xmlns": ANNOTATION_NAMESPACE} | settings, inside)
    return _Element("ssc:Annotation", {"type": ANNOTATION}, [whole])


def _named(scene: Scene):
    """All used variables of all components."""
    for component in scene.components.values():
        for name in _used(scene, component):
            yield component.fmu, component.fmu.variables[name]


def _enumerations(scene: Scene) -> list[_Element]:
    types = {v.declaredType.name: v.declaredType for _, v in _named(scene) if v.type == "Enumeration"}
    item = lambda one: _Element("ssc:Item", {"name": one.name, "value": int(one.value)})
    found = [_Element("ssc:Enumeration", {"name": n}, map(item, types[n].items)) for n in sorted(types)]
    return [_Element("ssd:Enumerations", None, found)] if found else []


def _units(scene: Scene) -> list[_Element]:
    exponents = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
    found = {}
    for fmu, variable in _named(scene):
        known = {unit.name: unit.baseUnit for unit in fmu.description.unitDefinitions}
        if variable.unit and known.get(variable.unit) is not None:
            base = known[variable.unit]
            attributes = {e: int(getattr(base, e)) for e in exponents if getattr(base, e)}
            attributes |= {} if float(base.factor) == 1.0 else {"factor": float(base.factor)}
            attributes |= {} if float(base.offset) == 0.0 else {"offset": float(base.offset)}
            found[variable.unit] = _Element("ssc:BaseUnit", attributes)
    units = [_Element("ssc:Unit", {"name": name}, [found[name]]) for name in sorted(found)]
    return [_Element("ssd:Units", None, units)] if units else []


# reading ------------------------------------------------------------------------------------------------------------
class _Source:
    """Where a scene file and its resources are: a folder, or an archive from which only what is used is unpacked."""

    def __init__(self, source: str | Path, variant: str = FILE):
        path = Path(source)
        self.path, self._unpacked = path, None
        if path.suffix == ".ssp":
            if not path.is_file():
                raise SceneError(f"no archive {path}")
            self._unpacked = tempfile.TemporaryDirectory(prefix="koppel-")
            self.folder, self.file = Path(self._unpacked.name), variant
        else:
            self.folder, self.file = (path.parent, path.name) if path.suffix == ".ssd" else (path, variant)

    def resource(self, name: str) -> Path | None:
        """Path of a file inside, None if it is not there."""
        path = (self.folder / name).resolve()
        if not path.is_relative_to(self.folder.resolve()):
            raise SceneError(f"{self.path}: {name} lies outside of the scene")
        if self._unpacked and not path.is_file():
            with zipfile.ZipFile(self.path) as archive:
                if name not in archive.namelist():
                    return None
                archive.extract(name, self.folder)
        return path if path.is_file() else None

    def root(self) -> ElementTree.Element:
        """The root element of the scene file."""
        path = self.resource(self.file)
        if path is None:
            raise SceneError(f"{self.path} has no {self.file}")
        try:
            return ElementTree.parse(path).getroot()
        except ElementTree.ParseError as wrong:
            raise SceneError(f"{self.path}: {self.file} is no XML: {wrong}") from None

    @property
    def archived(self) -> int | None:
        """FMUs in the archive, None for a folder."""
        if not self._unpacked:
            return None
        with zipfile.ZipFile(self.path) as archive:
            return sum(name.endswith(".fmu") for name in archive.namelist())

    def close(self):
        """Remove what was unpacked."""
        if self._unpacked:
            self._unpacked.cleanup()


def _local(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _all(element: ElementTree.Element | None, *path: str) -> list[ElementTree.Element]:
    """Descendants along a path of names without namespaces (SSP 1.0 and 2.0 share them)."""
    found = [] if element is None else [element]
    for name in path:
        found = [child for parent in found for child in parent if _local(child) == name]
    return found


def read(cls: type[Scene], source: str | Path, fmus=None, variant: str = FILE) -> Scene:
    """The scene in a folder, `.ssd` file or `.ssp` archive. FMUs that it does not hold are looked for in `fmus`.

    `variant`: another root file of the folder or archive.
    """
    where = _Source(source, variant)
    scene = None
    try:
        root = where.root()
        systems = _all(root, "System")
        if _local(root) != "SystemStructureDescription" or len(systems) != 1:
            raise SceneError(f"{where.path}: not a system structure description")
        scene = cls(root.get("name", systems[0].get("name", "scene")), fmus)
        _read_system(scene, systems[0], where)
        for experiment in _all(root, "DefaultExperiment"):
            scene.start = float(experiment.get("startTime", scene.start))
            scene.stop = float(experiment.get("stopTime", scene.stop))
        scene.archived = where.archived
        scene.folder = None if where.path.suffix == ".ssp" else where.folder
        return scene
    except BaseException:
        if scene is not None:
            scene.close_fmus()
        raise
    finally:
        where.close()


def _read_system(scene: Scene, system: ElementTree.Element, where: _Source):
    for element in _all(system, "Elements", "Component"):
        source = element.get("source", "")
        here = where.resource(source)
        # an archive that is in the scene counts, otherwise one of that name in the FMU folder
        fmu: str | Path | Fmu = Path(source).stem if here is None else here
        scene.add(element.get("name", ""), fmu, **dict(_values(element, where)))
    for element in _all(system, "Elements"):
        for other in element:
            if _local(other) != "Component":
                raise SceneError(f"{where.path}: {_local(other)} {other.get('name')} is not supported, only components")
    connections = []
    for element in _all(system, "Connections", "Connection"):
        transformation = (_all(element, "LinearTransformation") or [ElementTree.Element("none")])[0]
        ends = [(element.get(f"{e}Element"), element.get(f"{e}Connector")) for e in ("start", "end")]
        if None in (*ends[0], *ends[1]):
            raise SceneError(f"{where.path}: a connection of the system itself is not supported: {element.attrib}")
        factor, offset = float(transformation.get("factor", 1.0)), float(transformation.get("offset", 0.0))
        connections.append(Connection(*ends, factor, offset))
    scene.connect_all(connections)
    for annotation in _all(system, "Annotations", "Annotation"):
        if annotation.get("type") == ANNOTATION:
            _read_annotation(scene, annotation)


def _values(element: ElementTree.Element, where: _Source) -> Iterator[tuple[str, Value]]:
    for binding in _all(element, "ParameterBindings", "ParameterBinding"):
        sets = _all(binding, "ParameterValues", "ParameterSet")
        if source := binding.get("source"):
            path = where.resource(source)
            if path is None:
                raise SceneError(f"{where.path} has no {source}")
            sets = [ElementTree.parse(path).getroot()]
        for parameter in (p for one in sets for p in _all(one, "Parameters", "Parameter")):
            for value in parameter:
                yield parameter.get("name"), _value(_local(value), value.get("value"))


def _value(kind: str, value: str) -> Value:
    if kind in ("Real", "Float64"):
        return float(value)
    if kind == "Boolean":
        return value in ("true", "1")
    return int(value) if kind.startswith(("Int", "UInt")) else value


#: Types of the settings that are no numbers with a point.
_SETTING_TYPES = {"method": str, "integrator": str, "order": int}


def _read_annotation(scene: Scene, annotation: ElementTree.Element):
    named = lambda name: [element for element in annotation.iter() if _local(element) == name]
    for element in named("scene"):
        types = {f.name: _SETTING_TYPES.get(f.name, float) for f in fields(Settings)}
        unknown = set(element.attrib) - set(types)
        if unknown:
            raise SceneError(f"{scene.name}: unknown settings {', '.join(sorted(unknown))}")
        scene.configure(**{name: types[name](value) for name, value in element.attrib.items() if value})
    for element in named("joint"):
        scene.close(element.get("first"), element.get("second"))
    for element in named("assemble"):
        scene.assemble(element.get("variables", "").split())
    for element in named("record"):
        interval = element.get("interval")
        scene.record(*element.get("variables", "").split(), interval=float(interval) if interval else None)
    for element in named("reference"):
        scene.reference = element.get("file")
    for element in named("norm"):
        scene.norms[element.get("variable")] = float(element.get("value"))


__all__ = ["ANNOTATION", "FILE", "read", "text", "write"]
