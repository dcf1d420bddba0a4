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

    def call(self, verb, name, *values):
        variable = self.variables[name]
        function = getattr(self.unit, verb + CALLS[self.version][variable.type])
        return function([variable.valueReference], *values)

    def set(self, **values):
        for name, value in values.items():
            self.call("set", name.replace("__", "."), [value])

    def get(self, name):
        return self.call("get", name)[0]

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
