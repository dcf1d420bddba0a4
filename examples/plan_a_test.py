# %% [markdown]
# # Plan a test from a record
#
# This example prepares a ground motion and compares its demands with the rig. It finds the largest scale for
# the rig, and simulates the force on the structure.
#
# Run it whole (`python examples/plan_a_test.py`), or cell by cell in an editor that knows `# %%`.

# %%
from importlib import resources

import numpy as np
from matplotlib.figure import Figure

import eft
from eft import plots

rig = eft.Rig.zhao2005()
record = eft.read_record(resources.files("eft") / "data" / "RSN6_IMPVALL.I_I-ELC180-hor1.AT2")
print(record.name, f"{record.pga:.2f} m/s²")

# %% [markdown] The force is minus mass times ground acceleration. A band from 0.1 to 25 Hz keeps the motion
# of the structure and removes drift. A taper makes the test begin and end at rest.

# %%
prepared = record.baseline_corrected().band_passed(0.1, 25.0).tapered(start=1.0, end=2.0)


def command(scale: float) -> eft.Command:
    return eft.effective_force(prepared, mass=rig["structure.mass"], sample_rate=4096.0, scale=scale)


# %% [markdown] How large may the earthquake be? Check several scales before a test.

# %%
verdicts = {}
for scale in (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0):
    answer = eft.check_feasibility(rig, command(scale))
    spool = next(demand for demand in answer.demands if demand.name == "spool opening")
    verdicts[scale] = answer.verdict
    why = answer.reasons[0] if answer.reasons else ""
    print(f"scale {scale:4.2f}: {answer.verdict:7}  spool opening {spool.required:6.1%}  {why}")

largest = max(scale for scale, verdict in verdicts.items() if verdict == "go")

# %% [markdown] Simulate the largest scale with the verdict go, and look at the force.

# %%
run = eft.simulate(rig, command(largest))
ideal = eft.ideal_response(rig, command(largest))
metrics = run.metrics()
reached = np.abs(run.displacement).max() / np.abs(ideal.displacement).max()
print(
    f"at scale {largest:g}: force error {metrics['nrmse']:.1%}, {reached:.1%} of the ideal peak displacement"
)

# %%
figure = Figure(figsize=(7, 6), layout="constrained")
upper, middle, lower = figure.subplots(3, 1)
plots.force_history(run, window=(1.0, 8.0), ax=upper)
plots.displacement_history(run, ideal=ideal, ax=middle)
plots.spool_history(run, ax=lower)
figure.savefig("plan.png", dpi=150)
