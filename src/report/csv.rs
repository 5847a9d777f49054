//! Entries of a log as comma-separated values.
//!
//! Floats are printed in the shortest form that reads back exactly; durations and times inside `/timing` stay integer
//! nanoseconds.

use std::io::{self, Write};

use crate::log::topic::Kind;
use crate::log::{ContactMode, ContactSample, GroupStats, LogEntry, LogRecord, TextEvent};

/// The header line of a topic of this kind.
pub(super) fn header(kind: Kind) -> &'static str {
    match kind {
        Kind::Timing => "tick,scheduled_ns,woke_ns,start_ns,end_ns,deadline_ns,slips,cause,given_up,mode\n",
        Kind::Stats => {
            "t_s,released,skipped,missed,lost_records,lateness_p50_ns,lateness_p99_ns,lateness_max_ns,\
             execution_p50_ns,execution_p99_ns,execution_max_ns,port_uses\n"
        }
        Kind::Force | Kind::ForceCommanded => "t_s,fx_n,fy_n,fz_n\n",
        Kind::Tool => "t_s,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,sample_id,buttons\n",
        Kind::Contact => "t_s,mode,triangle,weight_a,weight_b,weight_c,nx,ny,nz,normal_force_n,tangential_force_n\n",
        Kind::Resync => "t_s,version,age_s,jump_before_n,jump_after_n,energy_j\n",
        Kind::Global => "t_s,version,first_tick,last_tick\n",
        Kind::Ports => "t_s,group,port,kind,tick,count,sequence\n",
        Kind::Probe => "t_s,node,local_x_m,local_y_m,local_z_m,global_x_m,global_y_m,global_z_m\n",
        // For viewers; refused before anything is asked of it.
        Kind::Scene => "",
        Kind::Log => "t_s,level,message\n",
    }
}

/// Writes one entry as a row under the header of its kind.
pub(super) fn row(entry: &LogEntry, out: &mut impl Write) -> io::Result<()> {
    match entry {
        LogEntry::Environment(_) | LogEntry::Attachment { .. } => Ok(()),
        LogEntry::Record(record) => record_row(record, out),
        LogEntry::Stats(stats) => stats_row(stats, out),
        LogEntry::Text(event) => text_row(event, out),
    }
}

fn record_row(record: &LogRecord, out: &mut impl Write) -> io::Result<()> {
    let t_s = record.time().as_secs_f64();
    match record {
        LogRecord::Tick(r) => {
            let (woke, start, end) = (r.woke.0, r.start.0, r.end.0);
            let (scheduled, deadline, cause) = (r.scheduled.0, r.deadline.0, r.cause.name());
            let (given_up, mode) = (r.given_up, r.mode.name());
            writeln!(
                out,
                "{},{scheduled},{woke},{start},{end},{deadline},{},{cause},{given_up},{mode}",
                r.tick, r.slips
            )
        }
        LogRecord::Force(r) => vector_row(t_s, r.force_n, out),
        LogRecord::Command(r) => vector_row(t_s, r.force_n, out),
        LogRecord::Tool(r) => {
            let ([x, y, z], [vx, vy, vz]) = (r.position_m, r.velocity_m_s);
            writeln!(out, "{t_s},{x},{y},{z},{vx},{vy},{vz},{},{}", r.id, r.buttons)
        }
        LogRecord::Contact(r) => contact_row(t_s, r, out),
        LogRecord::Resync(r) => {
            let (age_s, energy_j) = (r.age.as_secs_f64(), r.energy_j);
            writeln!(out, "{t_s},{},{age_s},{},{},{energy_j}", r.version, r.jump_before_n, r.jump_after_n)
        }
        LogRecord::Global(r) => writeln!(out, "{t_s},{},{},{}", r.version, r.first_tick, r.last_tick),
        LogRecord::Port(r) => {
            let (group, port, kind) = (r.group, r.port, r.kind.name());
            writeln!(out, "{t_s},{group},{port},{kind},{},{},{}", r.tick, r.count, r.sequence)
        }
        LogRecord::Probe(r) => {
            let ([x, y, z], [gx, gy, gz]) = (r.local_m, r.global_m);
            writeln!(out, "{t_s},{},{x},{y},{z},{gx},{gy},{gz}", r.node)
        }
        LogRecord::Event(r) => text_row(&TextEvent::describe(r, &format!("group {}", r.group)), out),
    }
}

fn vector_row(t_s: f64, [x, y, z]: [f64; 3], out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{t_s},{x},{y},{z}")
}

fn contact_row(t_s: f64, r: &ContactSample, out: &mut impl Write) -> io::Result<()> {
    let mode = match r.mode {
        ContactMode::Free => "free",
        ContactMode::Stick => "stick",
        ContactMode::Slip => "slip",
        ContactMode::Lost => "lost",
    };
    // No triangle is an empty cell, not the number that stands for it.
    let triangle = if r.triangle == u32::MAX { String::new() } else { r.triangle.to_string() };
    let ([b, c], [nx, ny, nz]) = (r.weights, r.normal);
    let a = 1.0 - b - c;
    let (normal, tangential) = (r.normal_force_n, r.tangential_force_n);
    writeln!(out, "{t_s},{mode},{triangle},{a},{b},{c},{nx},{ny},{nz},{normal},{tangential}")
}

fn stats_row(s: &GroupStats, out: &mut impl Write) -> io::Result<()> {
    write!(out, "{},{},{},{},{}", s.time.as_secs_f64(), s.released, s.skipped, s.missed, s.lost_records)?;
    for p in [s.lateness, s.execution] {
        write!(out, ",{},{},{}", p.p50, p.p99, p.max)?;
    }
    writeln!(out, ",{}", s.port_uses)
}

fn text_row(event: &TextEvent, out: &mut impl Write) -> io::Result<()> {
    let message = event.message.replace('"', "\"\"");
    writeln!(out, "{},{},\"{message}\"", event.time.as_secs_f64(), event.level.name())
}
