//! Events of the Trace Event Format, one JSON object a line.
//!
//! The format: "Trace Event Format" (Google, 2016), as Perfetto and chrome://tracing read it. Times are microseconds
//! since the start of the run with three decimals, which are the log's nanoseconds.

use std::fmt::Display;
use std::io::{self, Write};

use palpate::runtime::Nanos;

use crate::drawing::html::JsonString;
use crate::export::Micros;

/// The number of the one process that a run is.
const PROCESS: u32 = 1;

/// A track: a thread of the trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Track(pub(super) u32);

/// Whose track an instant is drawn on.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scope {
    Process,
    Track(Track),
}

/// The part of a flow that an event is.
#[derive(Clone, Copy, Debug)]
pub(super) enum Phase {
    Start,
    Step,
    Finish,
}

/// Writes events.
#[derive(Debug)]
pub(super) struct Events<W> {
    out: W,
    is_first: bool,
}

impl<W: Write> Events<W> {
    /// Begins a trace.
    pub(super) fn new(mut out: W) -> io::Result<Self> {
        out.write_all(b"{\"displayTimeUnit\":\"ns\",\"traceEvents\":[")?;
        let mut events = Self { out, is_first: true };
        events.metadata("process_name", Track(0), format_args!("\"name\":\"palpate\""))?;
        Ok(events)
    }

    /// Ends it; `about` is the inside of a JSON object.
    pub(super) fn finish(mut self, about: impl Display) -> io::Result<()> {
        writeln!(self.out, "\n],\"otherData\":{{{about}}}}}")?;
        self.out.flush()
    }

    /// Names a track or the process, or says where it belongs.
    pub(super) fn metadata(&mut self, what: &str, track: Track, args: impl Display) -> io::Result<()> {
        let (separator, tid) = (self.separator(), track.0);
        write!(
            self.out,
            "{separator}{{\"ph\":\"M\",\"pid\":{PROCESS},\"tid\":{tid},\"name\":\"{what}\",\"args\":{{{args}}}}}"
        )
    }

    /// Something that lasts from `start` to `end`. Those of a track must be apart or inside each other.
    pub(super) fn slice(
        &mut self,
        track: Track,
        name: &str,
        start: Nanos,
        end: Nanos,
        args: impl Display,
    ) -> io::Result<()> {
        let (separator, tid, ts, dur) = (self.separator(), track.0, Micros(start.0), Micros(end.0 - start.0));
        write!(
            self.out,
            "{separator}{{\"ph\":\"X\",\"pid\":{PROCESS},\"tid\":{tid},\"ts\":{ts},\"dur\":{dur},\"name\":{},\
             \"args\":{{{args}}}}}",
            JsonString(name)
        )
    }

    /// Something that has no length.
    pub(super) fn instant(
        &mut self,
        scope: Scope,
        category: &str,
        name: &str,
        time: Nanos,
        args: impl Display,
    ) -> io::Result<()> {
        let (separator, ts) = (self.separator(), Micros(time.0));
        let (scope, tid) = match scope {
            Scope::Process => ("p", 0),
            Scope::Track(track) => ("t", track.0),
        };
        write!(
            self.out,
            "{separator}{{\"ph\":\"i\",\"s\":\"{scope}\",\"pid\":{PROCESS},\"tid\":{tid},\"ts\":{ts},\
             \"cat\":\"{category}\",\"name\":{},\"args\":{{{args}}}}}",
            JsonString(name)
        )
    }

    /// The value that the counter `name` has from `time` on; finite, because JSON knows no other numbers.
    pub(super) fn counter(&mut self, name: &str, unit: &str, time: Nanos, value: f64) -> io::Result<()> {
        let (separator, ts) = (self.separator(), Micros(time.0));
        write!(
            self.out,
            "{separator}{{\"ph\":\"C\",\"pid\":{PROCESS},\"tid\":0,\"ts\":{ts},\"name\":{},\"args\":{{\"{unit}\":{value}}}}}",
            JsonString(name)
        )
    }

    /// One end or a joint of an arrow, bound to the slice of `track` around `time`.
    pub(super) fn flow(&mut self, phase: Phase, id: u64, track: Track, time: Nanos) -> io::Result<()> {
        let (separator, tid, ts) = (self.separator(), track.0, Micros(time.0));
        let phase = match phase {
            Phase::Start => "s",
            Phase::Step => "t",
            Phase::Finish => "f",
        };
        write!(
            self.out,
            "{separator}{{\"ph\":\"{phase}\",\"bp\":\"e\",\"id\":{id},\"pid\":{PROCESS},\"tid\":{tid},\"ts\":{ts},\
             \"cat\":\"flow\",\"name\":\"sample to force\"}}"
        )
    }

    fn separator(&mut self) -> &'static str {
        if std::mem::take(&mut self.is_first) { "\n" } else { ",\n" }
    }
}
