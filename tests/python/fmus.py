"""One instance of an FMU in FMPy, by names, in either version of FMI."""

import fmpy

CALLS = {
    2: {"Real": "Real", "Integer": "Integer", "Boolean": "Boolean"},
    3: {"Float64": "Float64", "Int32": "Int32", "Boolean": "Boolean"},
}


class Instance:
    """An FMU's file, unpacked into a folder, and one instance of it."""

    def __init__(self, file, folder):
        """Instantiate; `messages` collects the log of the FMU."""
        self.messages = []
        self.description = fmpy.read_model_description(str(file))
        self.version = int(self.description.fmiVersion[0])
        fmpy.extract(str(file), unzipdir=str(folder))
        self.unit = fmpy.instantiate_fmu(
            str(folder), self.description, "CoSimulation", logger=lambda *said: self.messages.append(said)
        )
        self.variables = {one.name: one for one in self.description.modelVariables}

    def set(self, **values):
        """Set variables, those of one type in one call of FMI."""
        kinds = {}
        for name, value in values.items():
            variable = self.variables[name.replace("__", ".")]
            references, given = kinds.setdefault(variable.type, ([], []))
            references.append(variable.valueReference)
            given.append(value)
        for kind, (references, given) in kinds.items():
            getattr(self.unit, f"set{CALLS[self.version][kind]}")(references, given)

    def get(self, name):
        return self.get_all([name])[0]

    def get_all(self, names):
        """The values of variables of one type, in one call of FMI."""
        variables = [self.variables[name] for name in names]
        (kind,) = {variable.type for variable in variables}
        get = getattr(self.unit, f"get{CALLS[self.version][kind]}")
        return get([variable.valueReference for variable in variables])

    def enter(self, start=0.0):
        if self.version == 2:
            self.unit.setupExperiment(startTime=start)
            self.unit.enterInitializationMode()
        else:
            self.unit.enterInitializationMode(startTime=start)

    def start(self, start=0.0, **parameters):
        self.set(**parameters)
        self.enter(start)
        self.unit.exitInitializationMode()

    def step(self, tick, period):
        self.unit.doStep(tick * period, period)

    def said(self):
        """The last message, as text."""
        return self.messages[-1][-1].decode()
