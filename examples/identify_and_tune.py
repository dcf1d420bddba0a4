# %% [markdown]
# # Identify a valve and tune the compensation
#
# A valve differs from its data sheet. This example measures a valve and puts the result into the
# configuration. The measurement is virtual: the true valve passes 6 % more than the controller's curve.

# %%
import numpy as np
from matplotlib.figure import Figure

import eft
from eft import plots

believed = eft.Rig.zhao2005()
true = believed.replace({"servovalve.flow_gain_scale": 1.06})
command = eft.sine_sweep(amplitude=8900.0, f_start=0.0, f_end=10.0, duration=32.0, sample_rate=4096.0)

# %% [markdown] With the curve of the data sheet the loop is unstable.

# %%
margins = eft.linear.stability_margins(believed)
print(f"the loop is stable up to a true flow gain of {margins.flow_gain[1]:.3f} of the configured one")
before = eft.simulate(true, command)
print(before.message)

# %% [markdown] The paper's tests: a sweep with the main stage shut off gives the response delay. Motions of
# different amplitude without a load give the flow curve.

# %%
spool_command, spool = eft.identification.valve_test(true)
delay = eft.identify_delay(spool_command, spool, 2048.0)
print(f"response delay {delay * 1e3:.2f} ± {delay.uncertainty * 1e3:.2f} ms")

stroke = true["actuator.stroke"]
runs = [eft.identification.flow_test(true, share * stroke) for share in (0.9, 0.8, 0.6, 0.4, 0.2)]
estimate = eft.identify_flow_curve(
    [spool for _, _, spool in runs],
    [displacement for _, displacement, _ in runs],
    2048.0,
    true["actuator.piston_area"],
)
openings = np.linspace(-0.9, 0.9, 19)
data_sheet = eft.FlowTable(
    believed["servovalve.flow_table.openings"], believed["servovalve.flow_table.flows"]
)
ratio = estimate.flow(openings[openings != 0]) / data_sheet.flow(openings[openings != 0])
print(f"the valve passes {ratio.mean():.3f} of the flow in the data sheet")

# %% [markdown] The measured curve becomes that of the controller. On the virtual rig the true valve is
# `flow_gain_scale` times that curve, so the scale is now the remaining error.

# %%
slope = (estimate.flow(0.05) - estimate.flow(-0.05)) / 0.1
tuned = true.replace(
    {
        "servovalve.flow_table": estimate,
        "servovalve.flow_gain_scale": 1.06 / ratio.mean(),
        "compensation.flow_gain": slope,
        "compensation.response_delay": float(delay),
    }
)
after = eft.simulate(tuned, command)
print(f"force error {after.metrics()['nrmse']:.1%}, spool opening {after.metrics()['max_spool']:.0%}")

# %%
figure = Figure(figsize=(7, 5), layout="constrained")
upper, lower = figure.subplots(2, 1)
plots.flow_curve(estimate, ax=upper)
upper.plot(data_sheet.openings, data_sheet.flows * 1e3, "--", color="0.5", label="data sheet")
upper.legend()
plots.force_ratio(after, ax=lower)
figure.savefig("tuned.png", dpi=150)
