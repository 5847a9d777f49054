//! The devices of a scene: one table, or several with names.

use super::{DeviceSpec, Equations, Scene, validate_device};
use crate::error::Error;

/// More hands than two people have; the log numbers them in few bits.
pub(crate) const MAX_DEVICES: usize = 8;

/// First words of topics that a device's own would be mistaken for.
const TAKEN: [&str; 5] = ["timing", "stats", "global", "ports", "log"];

/// What can be wrong with them.
pub(super) fn validate(scene: &Scene) -> Result<(), Error> {
    let devices = &scene.devices;
    if devices.is_empty() || devices.len() > MAX_DEVICES {
        let message = format!("is given {} times, a scene has 1 to {MAX_DEVICES}", devices.len());
        return Err(Error::scene("device", message));
    }
    for (index, device) in devices.iter().enumerate() {
        validate_device::device(device).map_err(|error| numbered(error, index, devices))?;
    }
    if devices.len() == 1 {
        return Ok(());
    }
    if scene.contact.equations == Equations::Paper {
        let message = "\"paper\" are equations for one tool, use \"corrected\" with several devices";
        return Err(Error::scene("contact.equations", message));
    }
    devices.iter().enumerate().try_for_each(|(index, device)| name(index, device, devices))
}

fn name(index: usize, device: &DeviceSpec, devices: &[DeviceSpec]) -> Result<(), Error> {
    let field = format!("{}.name", field(index, devices.len()));
    let Some(name) = &device.name else {
        return Err(Error::scene(
            &field,
            "is missing, each of several devices needs one for its topics and its report",
        ));
    };
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if name.is_empty() || !name.chars().all(is_plain) || TAKEN.contains(&name.as_str()) {
        let taken = TAKEN.join(", ");
        let message = format!("is {name:?}, must be of lower-case letters, digits and _, and none of {taken}");
        return Err(Error::scene(&field, message));
    }
    if devices[..index].iter().any(|other| other.name == device.name) {
        return Err(Error::scene(&field, format!("is {name:?}, as that of an earlier device, use another")));
    }
    Ok(())
}

/// `error` about `device`, which is the `index`-th of `devices`: with its number if there are several.
pub(crate) fn numbered(error: Error, index: usize, devices: &[DeviceSpec]) -> Error {
    error.with_place_of("device", &field(index, devices.len()))
}

/// Where the `index`-th of `count` devices stands in a scene: its number is given if there are several.
pub(crate) fn field(index: usize, count: usize) -> String {
    if count < 2 { "device".to_owned() } else { format!("device[{index}]") }
}

/// One table `[device]`, or several `[[device]]`.
pub(super) mod one_or_many {
    use serde::de::value::MapAccessDeserializer;
    use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
    use serde::ser::{Serialize, Serializer};

    use super::DeviceSpec;

    pub(in super::super) fn serialize<S: Serializer>(devices: &[DeviceSpec], to: S) -> Result<S::Ok, S::Error> {
        match devices {
            [one] => one.serialize(to),
            many => many.serialize(to),
        }
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<DeviceSpec>, D::Error> {
        struct OneOrMany;

        impl<'de> Visitor<'de> for OneOrMany {
            type Value = Vec<DeviceSpec>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table [device], or several [[device]]")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                Ok(vec![DeviceSpec::deserialize(MapAccessDeserializer::new(map))?])
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Self::Value, A::Error> {
                let mut devices = Vec::new();
                while let Some(device) = items.next_element()? {
                    devices.push(device);
                }
                Ok(devices)
            }
        }

        from.deserialize_any(OneOrMany)
    }
}
