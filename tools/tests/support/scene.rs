//! The small good scene of the tests of the command.

/// A block of 6^3 nodes that a tool touches after 9 ms, slips along and leaves: before a start-up would be over.
pub const SCENE: &str = r#"[body.block]
nodes = [6, 6, 6]
size_m = [0.1, 0.1, 0.1]
fixed = ["z_min"]
[body.material]
node_mass_kg = 0.0005
stiffness_n_per_m = 30.0
damping_ratio = 0.3
[contact]
friction = 0.5
[global]
rate_hz = 30
compute_latency_ms = 0
[local]
rate_hz = 1000
model = "patch"
patch = [3, 3, 2]
blend = { kind = "crossfade", ms = 10 }
[device]
path_csv = "path.csv"
[safety]
max_force_n = 8.0
max_slew_n_per_ms = 0.5
off = ["start_up"]
[[probe]]
node = [3, 3, 5]
[run]
duration_s = 0.2
"#;

pub const PATH: &str = "t_s,x_m,y_m,z_m\n0,0.05,0.05,0.101\n0.1,0.05,0.05,0.092\n0.2,0.06,0.05,0.092\n";
