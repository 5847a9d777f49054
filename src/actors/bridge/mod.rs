//! Two actors between the local and the global one where these are on different computers, or as if they were.
//!
//! ```text
//! local --ToolTick--> haptic bridge ~~ticks~~> global bridge --ToolTick--> global
//!       <--model-----               <~models~~               <--model-----
//!                                   <~bases~~~               <--bases----- basis
//!                                   ~~wants~~>               --bases-----> global
//! program --Settings-->             ~~wants~~>               --Settings-->
//!         <--SurfaceView--          <~~surface~~             <--SurfaceView--
//! ```
//!
//! There may be several haptic bridges, each at a machine with some of the devices: the global bridge tells each of them where the tools of
//! the others are. What they carry is made and taken here, off the real-time threads: the local actor has the same ports as without them and
//! cannot tell the difference. A basis comes to the global actor when the haptic machines have it.
//!
//! Each connection is an *epoch*. Its number stands in every message; the haptic side begins a new one when it has heard nothing for
//! [`SILENCE`], which by default is longer than a force lasts without a model, and the global side follows. What belongs to an older epoch is
//! dropped, on both sides.

mod global;
mod haptic;
mod machine;
mod numbering;
mod other_tool;
mod passed_bases;
mod post;
mod sent_bases;

use crate::runtime::Nanos;

pub use global::{Beyond, GlobalBridge, GlobalBridgePorts};
pub use haptic::{HapticBridge, HapticBridgePorts};
pub use passed_bases::BasesPorts;

/// A haptic side that has heard nothing for so long takes the connection for gone: by default no force is left by then.
pub const SILENCE: Nanos = Nanos(500_000_000);

/// Messages that a release takes at most: of a flood, the rest waits.
const MOST_MESSAGES: usize = 256;

/// Ticks that a message has at least, if there are so many: those before the newest are repeated.
const REPEATED: usize = 8;

/// The epoch that both sides begin with.
const FIRST_EPOCH: u64 = 1;

/// What names the basis of a patch (node ids in increasing order): FNV-1a.
fn key_of(patch: &[u32]) -> u64 {
    patch.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &node| (hash ^ u64::from(node)).wrapping_mul(0x0000_0100_0000_01b3))
}
