"""Station files that the tests read."""

# Every kind of connector, below every kind of limit.
WIRED = """\
name = "x"
description = "Every kind of wiring below every kind of limit"
[horizon]
steps = 4
step_s = 900
[control]
tick_ms = 1000
min_on_s = 300
min_off_s = 240
turn_s = 600
change_s = 7.5
ramp_A_per_s = 1.5
deadband_A = 0.3
[planning]
price_weight = 0.25
objective = "log-utility"
lambda_per_kWh2 = 12.5
outer_iterations = 4
horizon_steps = 3
replan = "events"
learn_taper = true
taper_lines = 2
[site]
failsafe_kW = 20.0
other_load_kW = 40.0
other_load_A = 120.0
voltage_V = 120
[[groups]]
name = "site"
limit_kW = 150.0
limit_A = 416.6
[[groups]]
name = "feeder"
parent = "site"
limit_A = 200.0
delta_side_A = 180.5
delta_side_V = 480
imbalance_A = 20.0
[[connectors]]
count = 1
group = "feeder"
kind = "AC"
phases = 3
rotation = "L2-L1-L3"
voltage_V = 120
min_A = 6.0
max_A = 32.0
fallback_A = 6.0
[[connectors]]
count = 1
group = "feeder"
kind = "AC"
phases = 1
phase = "L3"
voltage_V = 120
min_A = 6.0
max_A = 32.0
fallback_A = 8.0
reaction_s = 2.5
[[connectors]]
count = 1
group = "feeder"
kind = "AC"
phases = 1
between = "L1-L3"
voltage_V = 208
min_A = 6.0
max_A = 32.0
[[connectors]]
count = 1
group = "feeder"
kind = "DC"
efficiency = 0.925
voltage_V = 400
min_A = 1.0
max_A = 60.0
fallback_A = 1.0
reaction_s = 0.5
"""

# The ends of the ranges, all at once.
EDGES = """\
name = "x"
description = "The ends of all ranges"
[horizon]
steps = 255
step_s = 3600
[control]
tick_ms = 60000
min_on_s = 86400
min_off_s = 86400
turn_s = 86400
change_s = 600
ramp_A_per_s = 409.4
deadband_A = 409.4
[planning]
price_weight = 1
[site]
failsafe_kW = 3276.7
other_load_kW = 3276.7
other_load_A = 10000
voltage_V = 1500
[[groups]]
name = "site"
limit_kW = 3276.7
limit_A = 10000
imbalance_A = 10000
[[groups]]
name = "feeder"
parent = "site"
limit_A = 10000
delta_side_A = 833.333
delta_side_V = 36000
[[connectors]]
count = 239
group = "feeder"
kind = "AC"
phases = 3
rotation = "L3-L2-L1"
voltage_V = 1500
min_A = 409.4
max_A = 409.4
fallback_A = 409.4
reaction_s = 60
[[connectors]]
count = 1
group = "site"
kind = "DC"
voltage_V = 1500
min_A = 0
max_A = 0.1
efficiency = 0.004
reaction_s = 0
"""


def twelve_groups() -> str:
    """A site, three feeders that hang in a chain, and eight pods below them, children first in the file."""
    head = WIRED[: WIRED.index("[[groups]]")]
    feeders = [("f1", "site"), ("f2", "f1"), ("f3", "f2")]
    pods = [(f"p{k}", f"f{k % 3 + 1}") for k in range(8)]
    lines = [f'name = "{name}"\nparent = "{parent}"\nlimit_A = 90\n' for name, parent in pods + feeders]
    groups = "".join(f"[[groups]]\n{line}" for line in lines)
    site = '[[groups]]\nname = "site"\nlimit_kW = 150\nlimit_A = 400\n'
    run = 'phases = 1\nvoltage_V = 120\nmin_A = 6\nmax_A = 32\nkind = "AC"\ncount = 3\n'
    runs = "".join(f'[[connectors]]\ngroup = "p{k}"\nphase = "L{k % 3 + 1}"\n{run}' for k in range(8))
    return head + groups + site + runs
