"""A host for one instance of an FMI 2.0 archive, down to the C functions (fmpy's low-level layer)."""

from ctypes import CDLL, CFUNCTYPE, Structure, byref, c_char_p, c_double, c_int, c_uint, c_void_p

import fmpy
from fmpy import fmi2
from koppel import Message, Status, paths

# on this platform a variadic function is called like one with its arguments fixed; the format takes one string
Logger = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p, c_char_p)


class Callbacks(Structure):
    """`fmi2CallbackFunctions` with a logger that takes one argument after the format."""

    _fields_ = [("logger", Logger), *[(name, c_void_p) for name in ("allocate", "free", "finished", "environment")]]


class Archive:
    """An unpacked FMI 2.0 archive."""

    def __init__(self, name):
        self.path = paths.fmu(name, fmi=2)
        self.folder = fmpy.extract(str(self.path))
        self.description = fmpy.read_model_description(self.folder, validate=True, validate_model_structure=True)
        self.variables = {v.name: v for v in self.description.modelVariables}

    def references(self, names):
        """Value references as a C array."""
        return (c_uint * len(names))(*[self.variables[name].valueReference for name in names])

    def names(self, causality):
        """Names of all Real variables with this causality."""
        return [name for name, v in self.variables.items() if (v.causality, v.type) == (causality, "Real")]


class Host:
    """One instance. Functions that fail raise in `do`; `call` returns status and messages."""

    SETTERS = {
        "Real": ("fmi2SetReal", c_double),
        "Integer": ("fmi2SetInteger", c_int),
        "Enumeration": ("fmi2SetInteger", c_int),
        "Boolean": ("fmi2SetBoolean", c_int),
    }

    def __init__(self, archive, exchange=False):
        self.archive = archive
        self.messages = []
        self.categories = []
        kind = fmi2.FMU2Model if exchange else fmi2.FMU2Slave
        description = archive.description
        part = description.modelExchange if exchange else description.coSimulation
        self.fmu = kind(
            guid=description.guid,
            unzipDirectory=archive.folder,
            modelIdentifier=part.modelIdentifier,
            instanceName="one",
        )
        # the same library once more: without the argument types that fmpy has attached
        self.dll = CDLL(self.fmu.dll._name)
        self._logger = Logger(self._log)
        self.callbacks = Callbacks(logger=self._logger)
        self.kind = fmi2.fmi2ModelExchange if exchange else fmi2.fmi2CoSimulation
        self.component = None

    def instantiate(self, guid=None, name=b"one", callbacks="own", kind=None):
        """fmi2Instantiate; true if there is an instance."""
        create = self.dll.fmi2Instantiate
        create.restype = c_void_p
        create.argtypes = [c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int]
        self.component = create(
            name,
            self.kind if kind is None else kind,
            (self.archive.description.guid if guid is None else guid).encode(),
            None,
            byref(self.callbacks) if callbacks == "own" else None,
            0,
            0,
        )
        return self.component is not None

    def _log(self, _environment, instance, status, category, text, argument):
        assert (instance, text) == (b"one", b"%s")
        self.messages.append(Message(Status(status), category.decode(), argument.decode()))

    def __enter__(self):
        assert self.instantiate(), self.messages
        return self

    def __exit__(self, *_):
        self.dll.fmi2FreeInstance(c_void_p(self.component))

    def call(self, function, *arguments):
        """The C function itself: status and text of the messages."""
        before = len(self.messages)
        status = getattr(self.dll, function)(c_void_p(self.component), *arguments)
        return Status(status), "\n".join(message.text for message in self.messages[before:])

    def do(self, function, *arguments):
        """As `call`, but only OK will do."""
        status, text = self.call(function, *arguments)
        assert status == Status.OK, f"{function}: {status.name} {text}"

    def try_set(self, name, value):
        """One variable of any type: status and text."""
        function, ctype = self.SETTERS[self.archive.variables[name].type]
        return self.call(function, self.archive.references([name]), 1, (ctype * 1)(value))

    def set(self, values):
        """Variables of any type."""
        for name, value in values.items():
            status, text = self.try_set(name, value)
            assert status == Status.OK, text

    def get(self, names):
        """Real variables."""
        values = (c_double * len(names))()
        self.do("fmi2GetReal", self.archive.references(names), len(names), values)
        return list(values)

    def initialise(self, values=(), start=0.0):
        """To the end of initialisation."""
        self.set(dict(values))
        self.do("fmi2SetupExperiment", 0, c_double(0.0), c_double(start), 0, c_double(0.0))
        self.do("fmi2EnterInitializationMode")
        self.do("fmi2ExitInitializationMode")

    def try_step(self, t, step):
        """fmi2DoStep: status and text."""
        return self.call("fmi2DoStep", c_double(t), c_double(step), 1)

    def save(self):
        """fmi2GetFMUstate."""
        state = c_void_p()
        self.do("fmi2GetFMUstate", byref(state))
        return state
