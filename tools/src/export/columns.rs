//! The columns of each topic, and its entries as cells: what every table format writes, each in its own way.

use palpate::log::TopicKind;
use palpate::log::{
    CommandSample, ContactPointSample, ContactSample, ForceSample, GroupStats, LogEntry, LogRecord, TextEvent,
};
use palpate::model::contact::ContactMode;
use palpate::model::{Turn, wxyz};

/// The type of a column of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnType {
    /// Unsigned numbers of 64 bits.
    U64,
    /// Unsigned numbers of 32 bits.
    U32,
    /// Unsigned numbers of 32 bits that may be missing.
    OptionalU32,
    /// Doubles.
    F64,
    /// Floats of 32 bits.
    F32,
    /// Words and free text.
    Text,
}

/// One cell of a row of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// An unsigned number of 64 bits.
    U64(u64),
    /// An unsigned number of 32 bits.
    U32(u32),
    /// A double.
    F64(f64),
    /// A float of 32 bits.
    F32(f32),
    /// One of a few fixed words.
    Word(&'static str),
    /// Free text.
    Text(String),
    /// Nothing, in a column whose numbers may be missing.
    Missing,
}

/// A column of a table: its name with the unit at its end, and its type.
pub type Column = (&'static str, ColumnType);

/// Columns by their types, each name once: `U64: tick start_ns, Text: mode`.
macro_rules! table {
    ($($of:ident: $($name:ident)+),*) => { &[$($((stringify!($name), ColumnType::$of)),+),*] };
}

/// The columns of a topic of this kind; `is_turned` if a sample of it has a torque or is turned.
pub fn columns(kind: TopicKind, is_turned: bool) -> &'static [Column] {
    match kind {
        TopicKind::Force | TopicKind::ForceCommanded if is_turned => table! {
            F64: t_s fx_n fy_n fz_n tx_n_m ty_n_m tz_n_m
        },
        TopicKind::Tool if is_turned => table! {
            F64: t_s x_m y_m z_m vx_m_s vy_m_s vz_m_s, U32: sample_id buttons, F64: qw qx qy qz
        },
        TopicKind::Timing => table! {
            U64: tick scheduled_ns woke_ns start_ns end_ns deadline_ns, U32: slips, Text: cause, U32: given_up,
            Text: mode
        },
        TopicKind::Actors => table! { U64: scheduled_ns, U32: actor, U64: spent_ns },
        TopicKind::Stats => table! {
            F64: t_s, U64: released skipped missed lost_records lateness_p50_ns lateness_p99_ns lateness_max_ns
            execution_p50_ns execution_p99_ns execution_max_ns port_uses
        },
        TopicKind::Force | TopicKind::ForceCommanded => table! { F64: t_s fx_n fy_n fz_n },
        TopicKind::Tool => table! { F64: t_s x_m y_m z_m vx_m_s vy_m_s vz_m_s, U32: sample_id buttons },
        TopicKind::Contact => table! {
            F64: t_s, Text: mode, OptionalU32: triangle, F64: weight_a weight_b weight_c,
            F32: nx ny nz normal_force_n tangential_force_n, U32: count, F32: area_m2 mean_pressure_pa
        },
        TopicKind::Resync => table! { F64: t_s, U32: version, F64: age_s jump_before_n jump_after_n energy_j },
        TopicKind::Global => table! { F64: t_s, U32: version, U64: first_tick last_tick },
        TopicKind::Ports => table! { F64: t_s, U32: group port, Text: kind, U64: tick count sequence },
        TopicKind::Inputs => table! { F64: t_s, U32: group port, U64: sequence word_0 word_1 word_2 word_3 word_4 },
        TopicKind::Probe => table! {
            F64: t_s, U32: node, F64: local_x_m local_y_m local_z_m global_x_m global_y_m global_z_m
        },
        TopicKind::Link => table! {
            F64: t_s, U32: epoch, F64: round_trip_s clock_ahead_s clock_drift_ppm, U64: sent received lost
        },
        // For viewers; refused before anything is asked of it.
        TopicKind::Scene => &[],
        TopicKind::Log => table! { F64: t_s, Text: level message },
    }
}

/// True if an entry fills the columns that tools without torque and turn do not have.
pub fn is_turned(entry: &LogEntry) -> bool {
    match entry {
        LogEntry::Record(LogRecord::Force(r)) => r.torque_n_m != [0.0; 3],
        LogEntry::Record(LogRecord::Command(r)) => r.torque_n_m != [0.0; 3],
        LogEntry::Record(LogRecord::Tool(r)) => r.orientation != Turn::identity(),
        _ => false,
    }
}

/// The columns of the places of a topic with contacts.
pub const POINT_COLUMNS: &[Column] = table! {
    F64: t_s, F32: x_m y_m z_m nx ny nz normal_n tangential_n, U32: triangle, Text: mode
};

/// Puts the cells of a place that touches into `row`; leaves it empty for all else.
pub fn point_cells(entry: &LogEntry, row: &mut Vec<Cell>) {
    row.clear();
    if let LogEntry::Record(LogRecord::ContactPoint(r)) = entry {
        let ContactPointSample { place_m, normal, triangle, .. } = *r;
        row.push(Cell::F64(r.time.as_secs_f64()));
        row.extend(place_m.into_iter().chain(normal).chain(r.normal_and_tangential_n()).map(Cell::F32));
        row.extend([Cell::U32(triangle), mode(r.mode)]);
    }
}

/// Puts the cells of one entry into `row`, one for each column of its kind (`is_turned` or not), row behind row if it has several; leaves it empty
/// for what belongs in no table.
pub fn cells(entry: &LogEntry, is_turned: bool, row: &mut Vec<Cell>) {
    row.clear();
    match entry {
        LogEntry::Environment(_) | LogEntry::Attachment { .. } | LogEntry::Scene(_) => {}
        LogEntry::Record(record) => {
            record_cells(record, row);
            if is_turned {
                turned_cells(record, row);
            }
        }
        LogEntry::Stats(stats) => stats_cells(stats, row),
        LogEntry::Text(event) => text_cells(event, row),
    }
}

fn record_cells(record: &LogRecord, row: &mut Vec<Cell>) {
    use Cell::{F64, U32, U64, Word};
    let t_s = F64(record.time().as_secs_f64());
    match record {
        LogRecord::Tick(r) => {
            row.extend([r.tick, r.scheduled.0, r.woke.0, r.start.0, r.end.0, r.deadline.0].map(U64));
            row.extend([U32(r.slips), Word(r.cause.name()), U32(r.given_up.into()), Word(r.mode.name())]);
        }
        LogRecord::Actors(r) => {
            let rows = (0..).zip(r.spent()).flat_map(|(actor, spent)| [U64(r.scheduled.0), U32(actor), U64(spent.0)]);
            row.extend(rows);
        }
        LogRecord::Force(r) => floats(t_s, r.force_n, row),
        LogRecord::Command(r) => floats(t_s, r.force_n, row),
        LogRecord::Tool(r) => {
            floats(t_s, r.position_m, row);
            row.extend(r.velocity_m_s.map(F64));
            row.extend([U32(r.id), U32(r.buttons.into())]);
        }
        // In a table of their own.
        LogRecord::ContactPoint(_) => {}
        LogRecord::Contact(r) => contact_cells(t_s, r, row),
        LogRecord::Resync(r) => {
            row.extend([t_s, U32(r.version), F64(r.age.as_secs_f64())]);
            row.extend([r.jump_before_n, r.jump_after_n, r.energy_j].map(F64));
        }
        LogRecord::Link(r) => {
            row.extend([t_s, U32(r.epoch)]);
            row.extend([r.round_trip.as_secs_f64(), r.clock_ahead_s, r.clock_drift_ppm].map(F64));
            row.extend([r.sent, r.received, r.lost].map(U64));
        }
        LogRecord::Global(r) => row.extend([t_s, U32(r.version), U64(r.first_tick), U64(r.last_tick)]),
        LogRecord::Port(r) => {
            row.extend([t_s, U32(r.group.into()), U32(r.port), Word(r.kind.name())]);
            row.extend([r.tick, r.count, r.sequence].map(U64));
        }
        LogRecord::Input(r) => {
            row.extend([t_s, U32(r.group.into()), U32(r.port), U64(r.sequence)]);
            row.extend(r.value.map(U64));
        }
        LogRecord::Probe(r) => {
            row.extend([t_s, U32(r.node)]);
            row.extend(r.local_m.into_iter().chain(r.global_m).map(F64));
        }
        LogRecord::Event(r) => text_cells(&TextEvent::describe(r, &format!("group {}", r.group)), row),
    }
}

/// What only tools that are turned have.
fn turned_cells(record: &LogRecord, row: &mut Vec<Cell>) {
    match record {
        LogRecord::Force(ForceSample { torque_n_m, .. }) | LogRecord::Command(CommandSample { torque_n_m, .. }) => {
            row.extend(torque_n_m.map(Cell::F64));
        }
        LogRecord::Tool(r) => row.extend(wxyz(&r.orientation).map(Cell::F64)),
        _ => {}
    }
}

fn floats(t_s: Cell, vector: [f64; 3], row: &mut Vec<Cell>) {
    row.push(t_s);
    row.extend(vector.map(Cell::F64));
}

fn contact_cells(t_s: Cell, r: &ContactSample, row: &mut Vec<Cell>) {
    // No triangle is an empty cell, not the number that stands for it.
    let triangle = if r.triangle == u32::MAX { Cell::Missing } else { Cell::U32(r.triangle) };
    let [b, c] = r.weights;
    row.extend([t_s, mode(r.mode), triangle]);
    row.extend([1.0 - b - c, b, c].map(Cell::F64));
    row.extend(r.normal.map(Cell::F32));
    row.extend([r.normal_force_n, r.tangential_force_n].map(Cell::F32));
    row.extend([Cell::U32(r.count.into()), Cell::F32(r.area_m2), Cell::F32(r.mean_pressure_pa())]);
}

fn mode(mode: ContactMode) -> Cell {
    Cell::Word(match mode {
        ContactMode::Free => "free",
        ContactMode::Stick => "stick",
        ContactMode::Slip => "slip",
        ContactMode::Lost => "lost",
    })
}

fn stats_cells(s: &GroupStats, row: &mut Vec<Cell>) {
    row.push(Cell::F64(s.time.as_secs_f64()));
    row.extend([s.released, s.skipped, s.missed, s.lost_records].map(Cell::U64));
    for p in [s.lateness, s.execution] {
        row.extend([p.p50, p.p99, p.max].map(Cell::U64));
    }
    row.push(Cell::U64(s.port_uses));
}

fn text_cells(event: &TextEvent, row: &mut Vec<Cell>) {
    row.push(Cell::F64(event.time.as_secs_f64()));
    row.extend([Cell::Word(event.level.name()), Cell::Text(event.message.clone())]);
}
