//! Why an actor did less than it should.

use crate::devices::DeviceFault;

/// The causes that palpate's actors report with an outcome.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cause {
    /// The device could not be read or written.
    Device(DeviceFault),
    /// The device reported numbers that are not finite; the last state is used.
    DeviceNotFinite,
    /// The device reported a place that it cannot be at, by its workspace or by its last place; the last state is used.
    DeviceImpossible,
    /// The local model's force is not finite: zero is commanded until the next resync.
    LocalNotFinite,
    /// The global model's state is not finite: if it can be copied, it is started again from the last one that was.
    GlobalNotFinite,
    /// Samples of the tool were lost between local and global model; the path was interpolated.
    SamplesLost,
    /// The surroundings of a patch could not be reduced: its model serves without them.
    NoBasis,
    /// The global model was too late to follow the tool: it goes on from its newest surface and the newest tool.
    PathDropped,
    /// Nothing comes from the other computer any more: the local model fades out.
    LinkSilent,
}

impl Cause {
    const DEVICE: u32 = 256;

    /// The number that goes into outcomes and records.
    pub fn code(self) -> u32 {
        match self {
            Self::Device(fault) => Self::DEVICE + fault.code(),
            Self::DeviceNotFinite => 300,
            Self::LocalNotFinite => 301,
            Self::GlobalNotFinite => 302,
            Self::SamplesLost => 303,
            Self::NoBasis => 304,
            Self::PathDropped => 306,
            Self::DeviceImpossible => 305,
            Self::LinkSilent => 307,
        }
    }

    /// What the number means, in words; `None` if it is not palpate's.
    pub fn describe(code: u32) -> Option<&'static str> {
        if let Some(fault) = code.checked_sub(Self::DEVICE).and_then(DeviceFault::from_code) {
            return Some(fault.words());
        }
        Some(match code {
            300 => "the device reported numbers that are not finite",
            301 => "the local model's force is not finite, zero is commanded",
            302 => "the global model's state is not finite",
            304 => "the surroundings of a patch could not be reduced",
            306 => "the global model was too late to follow the tool, it goes on from the newest surface and tool",
            307 => "nothing comes from the global model's computer",
            305 => "the device reported a place where it cannot be, the last one is used",
            303 => "tool samples were lost between local and global model",
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_has_words() {
        let others = [
            Cause::DeviceNotFinite,
            Cause::DeviceImpossible,
            Cause::LocalNotFinite,
            Cause::GlobalNotFinite,
            Cause::SamplesLost,
            Cause::NoBasis,
            Cause::PathDropped,
            Cause::LinkSilent,
        ];
        let causes: Vec<Cause> = DeviceFault::ALL.map(Cause::Device).into_iter().chain(others).collect();
        for (index, cause) in causes.iter().enumerate() {
            assert!(Cause::describe(cause.code()).is_some(), "{cause:?}");
            assert!(causes[..index].iter().all(|other| other.code() != cause.code()), "{cause:?}");
        }
    }
}
