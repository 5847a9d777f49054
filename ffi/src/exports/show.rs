//! What a program draws: the newest surface, tools and contacts, without disturbing a tick.

use crate::boundary::boundary;
use crate::code::{Failure, PalpateCode};
use crate::memory::{check_size, fill, put, write};
use crate::session::SESSIONS;
use crate::types::{PalpateContact, PalpateSession, PalpateTool};

/// The numbers of nodes and of triangles of the surface; they never change. Nodes inside the body are counted too.
///
/// # Safety
/// The pointers are null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_surface_size(
    session: PalpateSession,
    nodes: *mut usize,
    triangles: *mut usize,
) -> PalpateCode {
    boundary(|| {
        SESSIONS.with(session.id, |live| {
            let viewer = live.viewer()?;
            let (node_count, triangle_count) = (viewer.surface().positions.len(), viewer.triangles().len());
            // SAFETY: the caller's promise.
            unsafe {
                put(nodes, node_count, "nodes")?;
                put(triangles, triangle_count, "triangles")
            }
        })
    })
}

/// The nodes of the surface's triangles, three numbers each, counter-clockwise seen from outside; they never change. `room` is the
/// number of triangles that there is room for.
///
/// # Safety
/// `triangles` is null or has room for three times `room` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_triangles(session: PalpateSession, triangles: *mut u32, room: usize) -> PalpateCode {
    boundary(|| {
        SESSIONS.with(session.id, |live| {
            let own = live.viewer()?.triangles();
            // SAFETY: the caller's promise.
            unsafe { fill(own.iter().copied(), triangles.cast(), room, "triangles") }
        })
    })
}

/// The newest positions of all nodes (m), three numbers each, and the time (s) that they belong to, if `time_s` is not null; they
/// come at the rate of the global model. `room` is the number of nodes that there is room for.
///
/// # Safety
/// `positions_m` is null or has room for three times `room` numbers; `time_s` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_surface(
    session: PalpateSession,
    positions_m: *mut f64,
    room: usize,
    time_s: *mut f64,
) -> PalpateCode {
    boundary(|| {
        SESSIONS.with(session.id, |live| {
            let surface = live.viewer()?.surface();
            let positions = surface.positions.iter().map(|&at| <[f64; 3]>::from(at));
            if !time_s.is_null() {
                // SAFETY: the caller's promise.
                unsafe { put(time_s, surface.time.as_secs_f64(), "time_s")? };
            }
            // SAFETY: the caller's promise.
            unsafe { fill(positions, positions_m.cast(), room, "positions_m") }
        })
    })
}

/// The newest tool, counted from 0, and its forces; they come at the haptic rate.
///
/// # Safety
/// `tool` is null or a struct that begins with its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_tool(session: PalpateSession, index: u32, tool: *mut PalpateTool) -> PalpateCode {
    boundary(|| {
        // SAFETY: the caller's promise.
        unsafe { check_size(tool)? };
        SESSIONS.with(session.id, |live| {
            let view = live.viewer()?.tools().nth(index as usize);
            let view = view.ok_or_else(|| Failure::argument(format!("there is no tool {index}, counted from 0")))?;
            // SAFETY: the caller's promise.
            unsafe { write(tool, PalpateTool::of(&view)) }
        })
    })
}

/// The places where tools touch, in the newest tick that is known: 0.1 to 0.15 s old, and up to 1.05 s while a part of the session takes
/// that long for one release. Their number is put at `count`, also if it is more than there is `room` for, which is a failure. Of a
/// session that was set up with palpate_setup_share_contacts.
///
/// # Safety
/// `contacts` is null or has room for `room` structs; `count` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_contacts(
    session: PalpateSession,
    contacts: *mut PalpateContact,
    room: usize,
    count: *mut usize,
) -> PalpateCode {
    boundary(|| {
        SESSIONS.with(session.id, |live| {
            let newest = live.newest_contacts()?;
            // SAFETY: the caller's promise.
            unsafe {
                put(count, newest.len(), "count")?;
                fill(newest.into_iter(), contacts, room, "contacts")
            }
        })
    })
}
