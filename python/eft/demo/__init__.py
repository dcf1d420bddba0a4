"""The paper's tests on the virtual rig, as one command: ``python -m eft.demo``."""
