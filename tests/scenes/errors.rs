//! Bad scene files are refused with one line: file, line, field and what would be right.

use palpate::scene::Scene;
use palpate::{Error, ErrorKind};
use proptest::prelude::*;

/// A good scene to spoil; the numbers of its lines are what the cases below expect.
const GOOD: &str = r#"[body]
kind = "mass_spring"
[body.block]
nodes = [12, 12, 12]
size_m = [0.1, 0.1, 0.1]
fixed = ["z_min"]
[body.material]
node_mass_kg = 0.0005
stiffness_n_per_m = 30.0
damping_ratio = 0.3
[contact]
friction = 1.0
normals = "interpolated"
[global]
rate_hz = 30
substeps_per_ms = 2
compute_latency_ms = 0
[local]
rate_hz = 1000
model = "patch"
patch = [4, 4, 2]
feedback = "geometry"
blend = { kind = "crossfade", ms = 10 }
[device]
kind = "scripted"
attach_node = [5, 5, 11]
[safety]
max_force_n = 3.0
max_slew_n_per_ms = 0.5
[initial]
pull = { node = [5, 5, 11], offset_m = [0.0, 0.0, 0.02] }
hold = [[8, 5, 11]]
[[probe]]
node = [8, 5, 11]
[[probe]]
node = [7, 5, 11]
[run]
duration_s = 2.0
"#;

struct Case {
    good: &'static str,
    bad: &'static str,
    /// What the error begins with.
    place: &'static str,
    /// What it must also say.
    words: &'static [&'static str],
}

const fn case(good: &'static str, bad: &'static str, place: &'static str, words: &'static [&'static str]) -> Case {
    Case { good, bad, place, words }
}

// One case a line reads like the table it is.
#[rustfmt::skip]
const CASES: &[Case] = &[
    // Unknown keys: the line, the dotted field, and the key that was meant or the keys there are.
    case("stiffness_n_per_m", "stiffness", "scene.toml:9: body.material.stiffness: ", &["unknown key", "did you mean stiffness_n_per_m?"]),
    case("size_m", "size_mm", "scene.toml:5: body.block.size_mm: ", &["did you mean size_m?"]),
    case("node_mass_kg", "mass_g", "scene.toml:8: body.material.mass_g: ", &["did you mean node_mass_kg?"]),
    case("[body]", "gravity = 9.81\n[body]", "scene.toml:1: gravity: ", &["unknown key", "body, contact, global"]),
    case("[safety]", "[safty]", "scene.toml:27: safty: ", &["did you mean safety?"]),
    case("patch = [4, 4, 2]", "rim = 50", "scene.toml:21: local.rim: ", &["rate_hz, model, error_pct, patch, basis, basis_folder, keep_bases, feedback, step, blend, coupling"]),
    case("patch = [4, 4, 2]", "basis = 5000", "scene.toml:21: local.basis: ", &["5000", "at most 500"]),
    case("ms = 10", "s = 10", "scene.toml:23: local.blend.s: ", &["unknown key", "did you mean ms?"]),
    case("node = [7, 5, 11]", "nodes = [7, 5, 11]", "scene.toml:36: probe[1].nodes: ", &["did you mean node?"]),
    case("duration_s", "\"a\\nb\"", "scene.toml:38: run.\"a\\nb\": ", &["unknown key", "duration_s"]),
    // Values of a wrong type.
    case("nodes = [12, 12, 12]", "nodes = [12, 12]", "scene.toml:4: body.block.nodes: ", &["has 2 entries", "array of 3"]),
    case("nodes = [12, 12, 12]", "nodes = [12, 12, 12, 12]", "scene.toml:4: body.block.nodes: ", &["has 4 entries"]),
    case("nodes = [12, 12, 12]", "nodes = 12", "scene.toml:4: body.block.nodes: ", &["is 12", "array of 3"]),
    case("nodes = [12, 12, 12]", "nodes = [12, 12.5, 12]", "scene.toml:4: body.block.nodes[1]: ", &["is 12.5", "whole number"]),
    case("nodes = [12, 12, 12]", "nodes = [12,\n12,\n-3]", "scene.toml:6: body.block.nodes[2]: ", &["is -3", "at least 0"]),
    case("stiffness_n_per_m = 30.0", "stiffness_n_per_m = \"30\"", "scene.toml:9: body.material.stiffness_n_per_m: ", &["is \"30\"", "must be a number"]),
    case("stiffness_n_per_m = 30.0", "stiffness_n_per_m = true", "scene.toml:9: body.material.stiffness_n_per_m: ", &["is true"]),
    case("[contact]", "[[contact]]", "scene.toml:11: ", &["contact", "table with the keys friction, static_friction, stribeck_m_s, normals, equations"]),
    case("friction = 1.0", "friction = \"sticky\"", "scene.toml:12: contact.friction: ", &["is \"sticky\"", "at least 0", "\"stick\""]),
    case("friction = 1.0", "friction = [1.0]", "scene.toml:12: contact.friction: ", &["is an array", "\"stick\""]),
    case("friction = 1.0", "friction = 1979-05-27", "scene.toml:12: contact.friction: ", &["a date", "\"stick\""]),
    case("substeps_per_ms = 2", "substeps_per_ms = 99999999999", "scene.toml:16: global.substeps_per_ms: ", &["at most 4294967295"]),
    case("substeps_per_ms = 2", "substeps_per_ms = 99999999999999999999999999", "scene.toml:16: global.substeps_per_ms: ", &["whole number"]),
    case("duration_s = 2.0", "duration_s = { s = 2 }", "scene.toml:38: run.duration_s: ", &["is a table", "a number"]),
    case("attach_node = [5, 5, 11]", "path_csv = 5", "scene.toml:26: device.path_csv: ", &["is 5", "text in quotes"]),
    // Missing keys, on the line of their table.
    case("stiffness_n_per_m = 30.0\n", "", "scene.toml:7: body.material.stiffness_n_per_m: ", &["missing"]),
    case("nodes = [12, 12, 12]\n", "", "scene.toml:3: body.block.nodes: ", &["missing"]),
    case("node = [7, 5, 11]\n", "", "scene.toml:35: probe[1].node: ", &["missing"]),
    case("kind = \"crossfade\", ", "", "scene.toml:23: local.blend.kind: ", &["missing"]),
    case("pull = { node = [5, 5, 11], offset_m = [0.0, 0.0, 0.02] }\n", "", "scene.toml:30: initial.pull: ", &["missing"]),
    // Words that do not exist.
    case("model = \"patch\"", "model = \"boundary\"", "scene.toml:20: local.model: ", &["is \"boundary\"", "\"hold\", \"patch\"", "\"predictive\", \"full\" or \"auto\""]),
    case("fixed = [\"z_min\"]", "fixed = [\"z_min\", \"bottom\"]", "scene.toml:6: body.block.fixed[1]: ", &["is \"bottom\"", "\"x_min\"", "\"z_max\""]),
    case("normals = \"interpolated\"", "normals = \"smooth\"", "scene.toml:13: contact.normals: ", &["\"interpolated\" or \"face\""]),
    case("feedback = \"geometry\"", "feedback = \"patch\"", "scene.toml:22: local.feedback: ", &["\"trajectory\", \"contact_nodes\" or \"geometry\""]),
    case("kind = \"crossfade\"", "kind = \"fade\"", "scene.toml:23: local.blend.kind: ", &["\"none\", \"crossfade\" or \"offset\""]),
    case("patch = [4, 4, 2]", "step = \"euler\"", "scene.toml:21: local.step: ", &["\"auto\", \"explicit\" or \"implicit\""]),
    case("kind = \"scripted\"", "kind = \"phantom\"", "scene.toml:25: device.kind: ", &["\"scripted\", \"hand\", \"replay\", \"pointer\" or \"haply\""]),
    case("kind = \"scripted\"", "kind = \"scripted\"\nplant = { mass_kg = 0.2 }", "scene.toml:26: device.plant: ", &["kind = \"hand\""]),
    case("kind = \"scripted\"", "kind = \"hand\"\nplant = { mass_kg = 0 }", "scene.toml:26: device.plant.mass_kg: ", &["is 0", "above 0"]),
    case("kind = \"scripted\"", "kind = \"hand\"\nplant = { axes = [\"w\"] }", "scene.toml:26: device.plant.axes[0]: ", &["\"x\", \"y\" or \"z\""]),
    case("kind = \"scripted\"", "kind = \"hand\"\nplant = { delay_ms = 200 }", "scene.toml:26: device.plant.delay_ms: ", &["100 ms at most"]),
    case("kind = \"scripted\"", "kind = \"hand\"\nhand = { grip = [[1, 1], [1, 0]] }", "scene.toml:26: device.hand.grip: ", &["must increase"]),
    case("kind = \"scripted\"", "kind = \"hand\"\nhand = { mass = 1 }", "scene.toml:26: device.hand.mass: ", &["did you mean mass_kg?"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\nlog = \"a.mcap\"", "scene.toml:26: device.log: ", &["kind = \"replay\""]),
    case("kind = \"scripted\"", "kind = \"replay\"", "scene.toml:24: device: ", &["no log to replay"]),
    case("kind = \"scripted\"", "profile = \"phantom\"", "scene.toml:25: device.profile: ", &["\"phantom_premium\", \"touch\"", "\"omega_3\""]),
    case("[safety]", "[[device.fault]]\nkind = \"late\"\nfrom_s = 1\nto_s = 1\n[safety]", "scene.toml:30: device.fault[0].to_s: ", &["is 1", "above from_s"]),
    case("[safety]", "[[device.fault]]\nkind = \"melted\"\nfrom_s = 1\nto_s = 2\n[safety]", "scene.toml:28: device.fault[0].kind: ", &["\"late\", \"lost\""]),
    case("[safety]", "[[device.fault]]\nkind = \"lost\"\nfrom_s = 1\nto_s = 2\nprobability = 2\n[safety]", "scene.toml:31: device.fault[0].probability: ", &["0 to 1"]),
    case("[safety]", "[[device.fault]]\nkind = \"lost\"\nfrom_s = 1\nto_s = 2\nreads = 5\n[safety]", "scene.toml:31: device.fault[0].reads: ", &["kind = \"late\"", "leave it out"]),
    case("[safety]", "[[device.fault]]\nkind = \"late\"\nfrom_s = 1\nto_s = 2\nprobability = 0.5\n[safety]", "scene.toml:31: device.fault[0].probability: ", &["kind = \"lost\""]),
    case("[safety]", "[[device.fault]]\nkind = \"frozen\"\nfrom_s = 1\nto_s = 2\nseed = 3\n[safety]", "scene.toml:31: device.fault[0].seed: ", &["kind = \"lost\""]),
    case("[safety]", "[[device.fault]]\nkind = \"disconnected\"\nfrom_s = 1\nto_s = 2\nstop = \"stall\"\n[safety]", "scene.toml:31: device.fault[0].stop: ", &["kind = \"safety_stop\""]),
    case("kind = \"mass_spring\"", "kind = 7", "scene.toml:2: body.kind: ", &["is 7", "\"mass_spring\""]),
    case("kind = \"scripted\"", "kind = \"haply\"", "scene.toml:", &["device.haply", "max_force_n"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\nhaply = { max_force_n = 3 }", "scene.toml:26: device.haply: ", &["belongs to kind = \"haply\""]),
    case("kind = \"scripted\"", "kind = \"scripted\"\nhaply = { address = \"x\" }", "scene.toml:26: device.haply.max_force_n: ", &["missing"]),
    case("kind = \"scripted\"", "kind = \"haply\"\nhaply = { max_force_n = 3 }", "scene.toml:27: device.attach_node: ", &["glues a tool"]),
    case("kind = \"scripted\"\nattach_node = [5, 5, 11]", "kind = \"haply\"\nprofile = \"touch\"\nhaply = { max_force_n = 3 }", "scene.toml:26: device.profile: ", &["simulated device"]),
    // The shape of a tool.
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = \"sphere\"", "scene.toml:26: device.tool: ", &["is \"sphere\"", "\"point\" or a table", "radius_m"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = 5", "scene.toml:26: device.tool: ", &["is 5", "\"point\" or a table"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"cube\" }", "scene.toml:26: device.tool.shape: ", &["is \"cube\"", "\"point\", \"sphere\" or \"capsule\""]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { radius_m = 0.004 }", "scene.toml:26: device.tool.shape: ", &["missing"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"sphere\" }", "scene.toml:26: device.tool.radius_m: ", &["missing"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"sphere\", radius = 0.004 }", "scene.toml:26: device.tool.radius: ", &["did you mean radius_m?"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"sphere\", radius_m = 0.004, length_m = 0.02 }", "scene.toml:26: device.tool: ", &["length_m belongs to shape = \"capsule\""]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"point\", radius_m = 0.004 }", "scene.toml:26: device.tool: ", &["radius_m belongs to shape = \"sphere\" or \"capsule\""]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"sphere\", radius_m = 0 }", "scene.toml:26: device.tool.radius_m: ", &["is 0", "above 0"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"sphere\", radius_m = 1e-5 }", "scene.toml:26: device.tool.radius_m: ", &["is 0.00001", "at least 0.0001 m", "tool = \"point\""]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"sphere\", radius_m = 4 }", "scene.toml:26: device.tool.radius_m: ", &["is 4", "at most 1 m", "metres"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"capsule\", radius_m = 0.004 }", "scene.toml:26: device.tool.length_m: ", &["missing"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"capsule\", radius_m = 0.004, length_m = -1 }", "scene.toml:26: device.tool.length_m: ", &["is -1", "at least 0"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"capsule\", radius_m = 0.004, length_m = 20 }", "scene.toml:26: device.tool.length_m: ", &["is 20", "below 1 m"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"capsule\", radius_m = 0.004, length_m = 0.02, axis = [0, 0, 0] }", "scene.toml:26: device.tool.axis: ", &["not all 0", "direction"]),
    case("kind = \"scripted\"", "kind = \"scripted\"\ntool = { shape = \"capsule\", radius_m = 0.004, length_m = 0.02, axis = [0, 1] }", "scene.toml:26: device.tool.axis: ", &["array of 3"]),
    // TOML itself.
    case("nodes = [12, 12, 12]", "nodes = [12, 12, 12", "scene.toml:5: ", &["TOML syntax"]),
    case("rate_hz = 30", "rate_hz 30", "scene.toml:15: ", &["TOML syntax"]),
    case("kind = \"scripted\"", "kind = \"scripted", "scene.toml:25: ", &["TOML syntax"]),
    case("size_m = [0.1, 0.1, 0.1]", "nodes = [3, 3, 3]", "scene.toml:5: body.block.nodes: ", &["given twice", "first on line 4"]),
    case("ms = 10 }", "kind = \"none\" }", "scene.toml:23: local.blend.kind: ", &["given twice"]),
    case("[safety]", "[body.block]", "scene.toml:27: body.block: ", &["given twice"]),
    case("node = [7, 5, 11]", "node = [7, 5, 11]\nnode = [7, 5, 11]", "scene.toml:37: probe[1].node: ", &["given twice", "first on line 36"]),
    // Impossible values: body.
    case("nodes = [12, 12, 12]", "nodes = [12, 0, 12]", "scene.toml:4: body.block.nodes: ", &["[12, 0, 12]", "at least 2"]),
    case("nodes = [12, 12, 12]", "nodes = [1200, 1200, 1200]", "scene.toml:4: body.block.nodes: ", &["at most 1000000"]),
    case("nodes = [12, 12, 12]", "nodes = [4294967296, 4294967296, 2]", "scene.toml:4: body.block.nodes: ", &["at most 1000000"]),
    case("size_m = [0.1, 0.1, 0.1]", "size_m = [0.1, 0.0, 0.1]", "scene.toml:5: body.block.size_m: ", &["above 0 m"]),
    case("size_m = [0.1, 0.1, 0.1]", "size_m = [0.1, nan, 0.1]", "scene.toml:5: body.block.size_m: ", &["finite"]),
    case("size_m = [0.1, 0.1, 0.1]", "size_m = [0.1, 1e-12, 1e-5]", "scene.toml:5: body.block.size_m: ", &["too small for contact"]),
    case("fixed = [\"z_min\"]", "fixed = [\"x_min\", \"x_max\", \"y_min\", \"y_max\", \"z_min\", \"z_max\"]", "scene.toml:6: body.block.fixed: ", &["six faces"]),
    case("node_mass_kg = 0.0005", "node_mass_kg = 0", "scene.toml:8: body.material.node_mass_kg: ", &["is 0", "above 0"]),
    case("node_mass_kg = 0.0005", "node_mass_kg = 1e-320", "scene.toml:7: body.material: ", &["beyond all numbers"]),
    case("stiffness_n_per_m = 30.0", "stiffness_n_per_m = -30.0", "scene.toml:9: body.material.stiffness_n_per_m: ", &["is -30", "above 0"]),
    case("stiffness_n_per_m = 30.0", "stiffness_n_per_m = inf", "scene.toml:9: body.material.stiffness_n_per_m: ", &["is inf", "finite"]),
    case("damping_ratio = 0.3", "damping_ratio = -0.1", "scene.toml:10: body.material.damping_ratio: ", &["at least 0"]),
    // Regions of the body.
    case("[contact]", "[[body.region]]\nshape = { sphere = { centre_m = [0, 0, 0], radius_m = 0.1 } }\n[contact]", "scene.toml:11: body.region[0]: ", &["differs in nothing", "stiffness_n_per_m"]),
    case("[contact]", "[[body.region]]\nstiffness_n_per_m = 3\n[contact]", "scene.toml:11: body.region[0].shape: ", &["missing"]),
    case("[contact]", "[[body.region]]\nstiffness = 3\n[contact]", "scene.toml:12: body.region[0].stiffness: ", &["did you mean stiffness_n_per_m?"]),
    case("[contact]", "[[body.region]]\nshape = \"sphere\"\n[contact]", "scene.toml:12: body.region[0].shape: ", &["is \"sphere\"", "a table with the keys sphere, box, ellipsoid, layer"]),
    case("[contact]", "[[body.region]]\nshape = {}\nstiffness_n_per_m = 3\n[contact]", "scene.toml:12: body.region[0].shape: ", &["one of sphere, box, ellipsoid or layer"]),
    case("[contact]", "[[body.region]]\nshape = { ball = {} }\n[contact]", "scene.toml:12: body.region[0].shape.ball: ", &["unknown key, the keys here are sphere, box, ellipsoid, layer"]),
    case("[contact]", "[[body.region]]\nshape = { sphere = { centre_m = [0, 0, 0], radius_m = 1 }, layer = { axis = \"z\", from_m = 0, to_m = 1 } }\n[contact]", "scene.toml:12: body.region[0].shape: ", &["several kinds", "a region for each"]),
    case("[contact]", "[[body.region]]\nshape = { sphere = { center_m = [0, 0, 0], radius_m = 1 } }\n[contact]", "scene.toml:12: body.region[0].shape.sphere.center_m: ", &["did you mean centre_m?"]),
    case("[contact]", "[[body.region]]\nshape = { sphere = { centre_m = [0, 0, 0] } }\n[contact]", "scene.toml:12: body.region[0].shape.sphere.radius_m: ", &["missing"]),
    case("[contact]", "[[body.region]]\nshape = { layer = { axis = \"w\", from_m = 0, to_m = 1 } }\n[contact]", "scene.toml:12: body.region[0].shape.layer.axis: ", &["\"x\", \"y\" or \"z\""]),
    case("[contact]", "[[body.region]]\nstiffness_n_per_m = 3\nshape = { layer = { axis = \"z\", from_m = 0.1, to_m = 0 } }\n[contact]", "scene.toml:13: body.region[0].shape.layer.to_m: ", &["is 0", "at least from_m, 0.1"]),
    case("[contact]", "[[body.region]]\nstiffness_n_per_m = 3\nshape = { sphere = { centre_m = [0, 0, 0], radius_m = -1 } }\n[contact]", "scene.toml:13: body.region[0].shape.sphere.radius_m: ", &["is -1", "above 0"]),
    case("[contact]", "[[body.region]]\nstiffness_n_per_m = 3\nshape = { box = { min_m = [0, 0, 0], max_m = [1, nan, 1] } }\n[contact]", "scene.toml:13: body.region[0].shape.box.max_m: ", &["finite"]),
    case("[contact]", "[[body.region]]\nstiffness_n_per_m = 3\nshape = { sphere = { centre_m = [0.005, 0.005, 0.005], radius_m = 0.001 } }\n[contact]", "scene.toml:13: body.region[0].shape: ", &["holds no node", "move or enlarge"]),
    case("[contact]", "[[body.region]]\nstiffness_n_per_m = 3\nshape = { layer = { axis = \"z\", from_m = 0, to_m = 1 } }\n[[body.region]]\nname = \"hard\"\nstiffness_n_per_m = 0\nshape = { layer = { axis = \"z\", from_m = 0, to_m = 1 } }\n[contact]", "scene.toml:16: body.region[1].stiffness_n_per_m: ", &["is 0", "above 0"]),
    case("[contact]", "[[body.region]]\ndamping_ratio = nan\nshape = { layer = { axis = \"z\", from_m = 0, to_m = 1 } }\n[contact]", "scene.toml:12: body.region[0].damping_ratio: ", &["finite"]),
    case("[contact]", "[[body.region]]\nnode_mass_kg = 1e-320\nshape = { layer = { axis = \"z\", from_m = 0, to_m = 1 } }\n[contact]", "scene.toml:11: body.region[0]: ", &["beyond all numbers"]),
    // Contact, global, local.
    case("friction = 1.0", "friction = -1", "scene.toml:12: contact.friction: ", &["is -1", "at least 0", "\"stick\""]),
    case("friction = 1.0", "friction = 1.0\nstatic_friction = 0.5", "scene.toml:13: contact.static_friction: ", &["is 0.5", "at least contact.friction, 1"]),
    case("friction = 1.0", "friction = 1.0\nstatic_friction = nan", "scene.toml:13: contact.static_friction: ", &["is NaN", "finite"]),
    case("friction = 1.0", "friction = 1.0\nstatic_friction = inf", "scene.toml:13: contact.static_friction: ", &["is inf", "finite"]),
    case("friction = 1.0", "friction = 1.0\nstatic = 2", "scene.toml:13: contact.static: ", &["static_friction"]),
    case("friction = 1.0", "friction = \"stick\"\nstatic_friction = 2", "scene.toml:13: contact.static_friction: ", &["never slides", "leave one of them out"]),
    case("friction = 1.0", "friction = 1.0\nstatic_friction = 2\nequations = \"paper\"", "scene.toml:13: contact.static_friction: ", &["one coefficient", "\"corrected\""]),
    case("friction = 1.0", "friction = 1.0\nstatic_friction = 2\nstribeck_m_s = -1", "scene.toml:14: contact.stribeck_m_s: ", &["is -1", "0 to 10 m/s"]),
    case("friction = 1.0", "friction = 1.0\nstatic_friction = 2\nstribeck_m_s = nan", "scene.toml:14: contact.stribeck_m_s: ", &["is NaN", "0 to 10 m/s"]),
    case("friction = 1.0", "friction = 1.0\nstatic_friction = 2\nstribeck_m_s = 11", "scene.toml:14: contact.stribeck_m_s: ", &["is 11", "0 to 10 m/s"]),
    case("friction = 1.0", "friction = 1.0\nstribeck_m_s = 0.01", "scene.toml:13: contact.stribeck_m_s: ", &["static_friction above friction", "leave it out"]),
    case("friction = 1.0", "friction = 1.0\nstatic_friction = 1.0\nstribeck_m_s = 0.01", "scene.toml:14: contact.stribeck_m_s: ", &["static_friction above friction"]),
    case("friction = 1.0", "friction = nan", "scene.toml:12: contact.friction: ", &["is NaN"]),
    case("rate_hz = 30", "rate_hz = 0", "scene.toml:15: global.rate_hz: ", &["is 0", "1000000 Hz"]),
    case("rate_hz = 1000", "rate_hz = 20", "scene.toml:19: local.rate_hz: ", &["is 20", "at least global.rate_hz, 30"]),
    case("rate_hz = 30", "rate_hz = 1001", "scene.toml:19: local.rate_hz: ", &["is 1000", "1001"]),
    case("substeps_per_ms = 2", "substeps_per_ms = 0", "scene.toml:16: global.substeps_per_ms: ", &["is 0", "1 to 10000", "stability limit"]),
    case("compute_latency_ms = 0", "compute_latency_ms = -1", "scene.toml:17: global.compute_latency_ms: ", &["is -1", "at least 0"]),
    case("patch = [4, 4, 2]", "patch = [4, 20, 2]", "scene.toml:21: local.patch: ", &["[4, 20, 2]", "[12, 12, 12]"]),
    case("patch = [4, 4, 2]", "patch = [4, 4, 1]", "scene.toml:21: local.patch: ", &["[2, 2, 2]"]),
    case("patch = [4, 4, 2]", "patch = [10, 10, 10]", "scene.toml:21: local.patch: ", &["1000 nodes", "512"]),
    case("compute_latency_ms = 0", "compute_latency_ms = 1e300", "scene.toml:17: global.compute_latency_ms: ", &["60000"]),
    case("model = \"patch\"", "model = \"hold\"", "scene.toml:22: local.feedback: ", &["\"geometry\"", "\"patch\"", "\"hold\""]),
    case("model = \"patch\"", "model = \"condensed\"", "scene.toml:22: local.feedback: ", &["\"geometry\"", "\"condensed\"", "compliance twice"]),
    case("model = \"patch\"", "model = \"scaled_boundary\"", "scene.toml:22: local.feedback: ", &["\"geometry\"", "compliance twice"]),
    case("model = \"patch\"\npatch = [4, 4, 2]\nfeedback = \"geometry\"", "model = \"full\"\nfeedback = \"contact_nodes\"", "scene.toml:21: local.feedback: ", &["\"contact_nodes\" needs", "\"patch\" or \"linear_boundary\" or \"scaled_boundary\"", "is \"full\""]),
    case("model = \"patch\"\npatch = [4, 4, 2]\nfeedback = \"geometry\"", "model = \"hold\"\nstep = \"implicit\"", "scene.toml:21: local.step: ", &["linear patch", "\"hold\""]),
    case("model = \"patch\"", "model = \"auto\"", "scene.toml:22: local.feedback: ", &["\"geometry\" needs", "\"patch\" or \"linear_boundary\"", "is \"auto\""]),
    case("model = \"patch\"\npatch = [4, 4, 2]\nfeedback = \"geometry\"", "step = \"implicit\"", "scene.toml:20: local.step: ", &["linear patch", "\"auto\""]),
    case("model = \"patch\"", "error_pct = 0\nmodel = \"patch\"", "scene.toml:20: local.error_pct: ", &["is 0", "above 0"]),
    case("kind = \"crossfade\", ms = 10", "kind = \"offset\"", "scene.toml:23: local.blend.ms: ", &["missing", "an offset"]),
    case("ms = 10", "ms = 0", "scene.toml:23: local.blend.ms: ", &["above 0"]),
    case(", ms = 10", "", "scene.toml:23: local.blend.ms: ", &["missing", "above 0"]),
    case("ms = 10", "ms = -5.0", "scene.toml:23: local.blend.ms: ", &["is -5"]),
    case("ms = 10", "ms = 34", "scene.toml:23: local.blend.ms: ", &["is 34", "at most 33.3", "global.rate_hz"]),
    // Device, safety, initial, probe, run.
    case("attach_node = [5, 5, 11]", "attach_node = [5, 5, 12]", "scene.toml:26: device.attach_node: ", &["[5, 5, 12] is outside", "[11, 11, 11]"]),
    case("attach_node = [5, 5, 11]", "attach_node = [5, 5, 0]", "scene.toml:26: device.attach_node: ", &["fixed face z_min", "could not move"]),
    case("attach_node = [5, 5, 11]", "attach_node = [5, 5, 6]", "scene.toml:26: device.attach_node: ", &["surface"]),
    case("attach_node = [5, 5, 11]\n", "", "scene.toml:24: device: ", &["path_csv", "attach_node"]),
    case("attach_node", "path_csv = \"nowhere.csv\"\nattach_node", "scene.toml:26: device.path_csv: ", &["nowhere.csv", "No such file"]),
    case("max_force_n = 3.0", "max_force_n = 0.0", "scene.toml:28: safety.max_force_n: ", &["above 0"]),
    case("max_slew_n_per_ms = 0.5", "off = [\"slew\", \"clamp\"]", "scene.toml:29: safety.off: ", &["\"clamp\"", "cannot be switched off"]),
    case("max_slew_n_per_ms = 0.5", "off = [\"speed\"]", "scene.toml:29: safety.off[0]: ", &["\"slew\", \"tool_speed\", \"tank\""]),
    case("max_slew_n_per_ms = 0.5", "stop_speed_m_s = 0.5", "scene.toml:29: safety.stop_speed_m_s: ", &["above safety.fade_speed_m_s"]),
    case("max_slew_n_per_ms = 0.5", "start_up_ms = 1e9", "scene.toml:29: safety.start_up_ms: ", &["at most 60000 ms"]),
    case("max_slew_n_per_ms = 0.5", "max_slew_n_per_ms = inf", "scene.toml:29: safety.max_slew_n_per_ms: ", &["finite"]),
    case("pull = { node = [5, 5, 11]", "pull = { node = [99, 5, 11]", "scene.toml:31: initial.pull.node: ", &["[99, 5, 11] is outside"]),
    case("pull = { node = [5, 5, 11]", "pull = { node = [5, 5, 0]", "scene.toml:31: initial.pull.node: ", &["fixed face z_min"]),
    case("0.02] }", "nan] }", "scene.toml:31: initial.pull.offset_m: ", &["finite"]),
    case("hold = [[8, 5, 11]]", "hold = [[8, 5, 11], [12, 0, 0]]", "scene.toml:32: initial.hold: ", &["[12, 0, 0] is outside"]),
    case("hold = [[8, 5, 11]]", "hold = [[5, 5, 11]]", "scene.toml:32: initial.hold: ", &["pulled node"]),
    case("fixed = [\"z_min\"]", "fixed = []", "scene.toml:31: initial.pull: ", &["fixed face", "body.block.fixed"]),
    case("node = [7, 5, 11]", "node = [7, 55, 11]", "scene.toml:36: probe[1].node: ", &["[7, 55, 11] is outside"]),
    case("duration_s = 2.0", "duration_s = 0.0", "scene.toml:38: run.duration_s: ", &["above 0"]),
    case("duration_s = 2.0", "duration_s = 1e-6", "scene.toml:38: run.duration_s: ", &["one haptic period", "0.001"]),
];

fn refusal(text: &str) -> Error {
    Scene::from_toml(text, "scene.toml", None).expect_err(text)
}

fn is_one_line(message: &str) -> bool {
    !message.chars().any(char::is_control)
}

#[test]
fn every_mistake_is_named_with_line_field_and_remedy() {
    Scene::from_toml(GOOD, "scene.toml", None).expect("the scene that the cases spoil is good");
    let mut failures = Vec::new();
    for Case { good, bad, place, words } in CASES {
        assert!(GOOD.contains(good), "no {good:?} to spoil");
        let error = refusal(&GOOD.replacen(good, bad, 1));
        let message = error.to_string();
        let is_complete = message.starts_with(place) && words.iter().all(|word| message.contains(word));
        if !is_complete || !is_one_line(&message) || !error.kind().is_input() {
            failures.push(format!("{bad:?} gives\n    {message}\n  instead of\n    {place} .. {words:?}"));
        }
    }
    assert!(failures.is_empty(), "{} of {} cases:\n{}", failures.len(), CASES.len(), failures.join("\n"));
}

#[test]
fn an_empty_file_misses_its_body() {
    for text in ["", "\n\n# nothing\n"] {
        let message = refusal(text).to_string();
        assert!(message.starts_with("scene.toml:1: body: is missing"), "{message}");
    }
}

#[test]
fn dotted_keys_and_inline_tables_are_located_too() {
    let text = "body.block = { nodes = [2, 2, 2],\n  size_m = [1, 1, -1] }\nbody.material.node_mass_kg = 1\nbody.material.stiffness_n_per_m = 1\nbody.material.damping_ratio = 1\n";
    let message = refusal(text).to_string();
    assert!(message.starts_with("scene.toml:2: body.block.size_m: "), "{message}");
    let message = refusal(&text.replace("stiffness_n_per_m", "stiff")).to_string();
    assert!(message.starts_with("scene.toml:4: body.material.stiff: unknown key"), "{message}");
    let message = refusal(&text.replace("body.material.stiffness_n_per_m = 1\n", "")).to_string();
    assert!(message.contains("body.material.stiffness_n_per_m: is missing"), "{message}");
}

#[test]
fn a_key_given_twice_names_its_first_line_only_where_that_is_sure() {
    for (text, expected) in [
        ("a = 1\na = 2", "scene.toml:2: a: is given twice, first on line 1, keep one"),
        ("\n[x]\n[x]", "scene.toml:3: x: is given twice, keep one"),
        ("[x]\n\"a.b\" = 1\n\"a.b\" = 1", "scene.toml:3: x.\"a.b\": is given twice, keep one"),
        ("x.a = 1\n\nx.a = 2", "scene.toml:3: x.a: is given twice, first on line 1, keep one"),
        (
            "[body]\nblock.nodes = 1\nblock.nodes = 2",
            "scene.toml:3: body.block.nodes: is given twice, first on line 2, keep one",
        ),
    ] {
        let message = refusal(text).to_string();
        assert_eq!(message, expected);
    }
}

#[test]
fn a_missing_section_is_named_on_the_line_of_the_table_around_it() {
    let message = refusal("# a comment\n[body]\nkind = \"mass_spring\"\n").to_string();
    assert!(message.starts_with("scene.toml:2: body.block: is missing"), "{message}");
    let message = refusal("# a comment\n[body.block]\nnodes = [2, 2, 2]\nsize_m = [1, 1, 1]\n").to_string();
    assert!(message.contains("body.material: is missing"), "{message}");
}

#[test]
fn numbers_may_be_written_in_every_way_of_toml() {
    let text = GOOD
        .replace("rate_hz = 1000", "rate_hz = 1_000.0")
        .replace("substeps_per_ms = 2", "substeps_per_ms = 0x2")
        .replace("friction = 1.0", "friction = 1")
        .replace("duration_s = 2.0", "duration_s = +2e0");
    assert_eq!(
        Scene::from_toml(&text, "s", None).map(|scene| Scene { source: None, ..scene }).unwrap(),
        Scene::from_toml(GOOD, "s", None).map(|scene| Scene { source: None, ..scene }).unwrap()
    );
}

#[test]
fn a_windows_file_has_the_same_lines() {
    let text = GOOD.replace('\n', "\r\n");
    Scene::from_toml(&text, "scene.toml", None).unwrap();
    let message = refusal(&text.replace("damping_ratio = 0.3", "damping_ratio = -1")).to_string();
    assert!(message.starts_with("scene.toml:10: body.material.damping_ratio: "), "{message}");
}

#[test]
fn a_small_body_needs_no_patch_for_a_model_without_one() {
    let small = GOOD
        .replace("nodes = [12, 12, 12]", "nodes = [3, 3, 3]")
        .replace("[5, 5, 11]", "[1, 1, 2]")
        .replace("[8, 5, 11]", "[2, 1, 2]")
        .replace("[7, 5, 11]", "[0, 1, 2]");
    assert!(refusal(&small).to_string().contains("local.patch"));
    let full = small.replace("model = \"patch\"", "model = \"full\"").replace("feedback = \"geometry\"\n", "");
    let full = full.replace("patch = [4, 4, 2]\n", "");
    Scene::from_toml(&full, "s", None).unwrap();
    let asked_for = full.replace("model = \"full\"", "model = \"full\"\npatch = [4, 4, 2]");
    assert!(refusal(&asked_for).to_string().contains("local.patch"));
}

/// A stack overflow would end the program, so the depth of the text must not become a depth of calls.
#[test]
fn deep_nesting_is_refused_in_one_line() {
    for deep in [
        format!("a = {}", "[".repeat(100_000)),
        format!("a = {}", "{ a = ".repeat(100_000)),
        format!("{} = 1", vec!["a"; 100_000].join(".")),
        format!("[{}]", vec!["a"; 100_000].join(".")),
    ] {
        assert!(is_one_line(&refusal(&deep).to_string()));
    }
}

#[test]
fn files_that_cannot_be_read_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let missing = Scene::load(&folder.path().join("none.toml")).unwrap_err();
    assert_eq!(missing.kind(), ErrorKind::Io);
    assert!(missing.to_string().contains("none.toml") && is_one_line(&missing.to_string()), "{missing}");

    let latin = folder.path().join("latin.toml");
    std::fs::write(&latin, b"[body]\n# caf\xe9\n").unwrap();
    let message = Scene::load(&latin).unwrap_err().to_string();
    assert!(message.contains("latin.toml:2: is not UTF-8"), "{message}");
}

#[test]
fn a_bad_path_file_is_named_with_its_own_line() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, GOOD.replace("attach_node", "path_csv = \"sub/path.csv\"\nattach_node")).unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    let csv = folder.path().join("sub/path.csv");

    std::fs::write(&csv, "t_s,x_m,y_m,z_m\n0,0,0,0\n0.001,0,nan,0\n").unwrap();
    let message = Scene::load(&scene).unwrap_err().to_string();
    assert!(message.contains("path.csv:3: y_m is NaN"), "{message}");

    std::fs::write(&csv, "t_s,x_m,y_m,z_m\n0,0,0,0\n1,0,0,2\n").unwrap();
    let path = Scene::load(&scene).unwrap().devices[0].path.clone().unwrap();
    assert_eq!(path.at(0.5), [0.0, 0.0, 1.0]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Check that no text makes the reader panic or speak in several lines: random splices of a good scene.
    #[test]
    fn a_mangled_scene_gives_at_most_one_line(
        start in 0..GOOD.len(),
        length in 0_usize..40,
        insert in prop_oneof![
            "[ -~\\n]{0,12}",
            proptest::sample::select(vec![
                "[", "]", "{", "}", "\"", "'''", "\n[body]\n", "\n[[probe]]\n", "= 1", "nan", "-inf", "1e999", "\u{7}", "é",
                "999999999999999999999", "a.b.c", "[[[[[[", "\"\\u0000\" = 1\n", "\r",
            ]).prop_map(str::to_owned),
        ],
    ) {
        let end = (start + length).min(GOOD.len());
        let text = format!("{}{insert}{}", &GOOD[..start], &GOOD[end..]);
        if let Err(error) = Scene::from_toml(&text, "scene.toml", None) {
            let message = error.to_string();
            prop_assert!(is_one_line(&message), "{message:?}");
            prop_assert!(message.starts_with("scene.toml:"), "{message:?}");
            let line: usize = message["scene.toml:".len()..].split(':').next().unwrap().parse().unwrap();
            prop_assert!((1..=text.lines().count() + 1).contains(&line), "{message:?}");
        }
    }

    /// Check that swapped lines, the commonest slip of an editor, are survived as well.
    #[test]
    fn shuffled_lines_give_at_most_one_line(seed in any::<Vec<prop::sample::Index>>()) {
        let mut lines: Vec<&str> = GOOD.lines().collect();
        for pair in seed.chunks_exact(2) {
            let (a, b) = (pair[0].index(lines.len()), pair[1].index(lines.len()));
            lines.swap(a, b);
        }
        if let Err(error) = Scene::from_toml(&lines.join("\n"), "scene.toml", None) {
            prop_assert!(is_one_line(&error.to_string()), "{error}");
        }
    }
}

#[test]
fn the_paper_equations_are_for_a_point() {
    let paper = GOOD.replace("normals = \"interpolated\"", "equations = \"paper\"");
    for (tool, name) in [
        ("{ shape = \"sphere\", radius_m = 0.004 }", "sphere"),
        ("{ shape = \"capsule\", radius_m = 0.003, length_m = 0.02 }", "capsule"),
    ] {
        let with = |text: &str| text.replace("kind = \"scripted\"", &format!("kind = \"scripted\"\ntool = {tool}"));
        let message = refusal(&with(&paper)).to_string();
        assert!(message.starts_with(&format!("scene.toml:26: device.tool: is a {name}")), "{message}");
        assert!(message.contains("use \"corrected\" there or tool = \"point\""), "{message}");
        Scene::from_toml(&with(GOOD), "scene.toml", None).unwrap();
    }
    Scene::from_toml(&paper.replace("kind = \"scripted\"", "tool = \"point\""), "scene.toml", None).unwrap();
}

#[test]
fn an_implicit_step_has_no_paper_equations() {
    let text = GOOD.replace("patch = [4, 4, 2]", "patch = [4, 4, 2]\nstep = \"implicit\"");
    Scene::from_toml(&text, "scene.toml", None).unwrap();
    let paper = text.replace("normals = \"interpolated\"", "normals = \"interpolated\"\nequations = \"paper\"");
    let message = refusal(&paper).to_string();
    assert!(message.starts_with("scene.toml:23: local.step: ") && message.contains("corrected"), "{message}");
}

// Check that who writes calls reads of calls.
#[test]
fn errors_of_a_builder_name_its_calls() {
    use palpate::prelude::*;
    let session = || Session::builder(Block::builder([5; 3], [0.1; 3]).fix(Face::ZMin).build().unwrap());
    let path = || ToolPath::constant([0.05, 0.05, 0.09]).unwrap();
    let errors = [
        (session().path(path()).friction(-1.0), "friction(): is -1, must be"),
        (session().path(path()).local(RateGroup::hz(20)), "local(): is 20, must be at least global(), 30"),
        (session().path(path()).offset_ms(0.0), "offset_ms(): is 0"),
        (session().path(path()).substeps_per_ms(0), "substeps_per_ms(): is 0"),
        (session().path(path()).duration_s(-1.0), "duration_s(): is -1"),
        (session().path(path()).patch([4, 4, 0]), "patch(): is [4, 4, 0], must be at least [2, 2, 2]"),
        (session().path(path()).patch([usize::MAX, 4, 2]), "patch(): is [18446744073709551615, 4, 2], must be"),
        (session().path(path()).patch([9, 9, 9]), "patch(): is [9, 9, 9], must be"),
        (session(), "device: nothing moves the tool: give it a path(), an attach_node() or a device"),
    ];
    for (session, words) in errors {
        let error = session.virtual_time().build().unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        assert!(error.to_string().starts_with(words), "{error}, not {words}");
        assert!(
            !["local.", "global.", "contact.", "run.", "device."].iter().any(|key| error.to_string().contains(key)),
            "{error}"
        );
    }
    // A scene of a file has keys.
    let error = Session::from_scene(Scene::demo()).friction(-1.0).build().unwrap_err();
    assert!(error.to_string().starts_with("contact.friction: "), "{error}");
}

#[test]
fn the_calls_of_a_builder_come_in_any_order() {
    use palpate::model::local::{Feedback, Kind};
    use palpate::prelude::*;
    use palpate::scene::StepKind;
    let session = || {
        let block = Block::builder([5; 3], [0.1; 3]).fix(Face::ZMin).build().unwrap();
        Session::builder(block).path(ToolPath::constant([0.05, 0.05, 0.09]).unwrap()).virtual_time()
    };
    let refused = |session: SessionBuilder| session.build().unwrap_err().to_string();
    let fed = |session: SessionBuilder| session.feedback(Feedback::Geometry);
    let stepped = |session: SessionBuilder| session.local_step(StepKind::Implicit);
    let first = [refused(fed(session()).model(Kind::Hold)), refused(stepped(session()).model(Kind::Hold))];
    let last = [refused(fed(session().model(Kind::Hold))), refused(stepped(session().model(Kind::Hold)))];
    assert_eq!(first, last);
    assert!(first[0].starts_with("feedback(): ") && first[1].starts_with("local_step(): "), "{first:?}");
    // One that is named later may suit what was asked before.
    assert!(fed(session()).model(Kind::Hold).model(Kind::Patch).build().is_ok());
}
