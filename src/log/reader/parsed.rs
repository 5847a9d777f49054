//! Records taken apart, whatever their bytes.

use mcap::records::{Record, op};

/// The lengths, times and checksum of an attachment with nothing in it (bytes).
const EMPTY_ATTACHMENT_BYTES: usize = 8 + 8 + 4 + 4 + 8 + 4;

/// The record in `body`, in words what is wrong with it. [`mcap::parse_record`] takes the checksum at the end of an attachment
/// for granted and panics without one.
///
/// # Errors
/// If it does not decode.
pub fn parse_record(opcode: u8, body: &[u8]) -> Result<Record<'_>, String> {
    if opcode == op::ATTACHMENT && !holds_attachment(body) {
        return Err("an attachment ends before its checksum".into());
    }
    #[expect(clippy::disallowed_methods, reason = "attachments are long enough here")]
    mcap::parse_record(opcode, body).map_err(|e| e.to_string())
}

/// True if all of an attachment but its data fits in `body`.
fn holds_attachment(body: &[u8]) -> bool {
    let text = |at: usize| {
        let length = body.get(at..)?.first_chunk::<4>()?;
        Some(u32::from_le_bytes(*length) as usize)
    };
    let needed = || {
        let name = text(16)?;
        let media_type = text(20_usize.checked_add(name)?)?;
        EMPTY_ATTACHMENT_BYTES.checked_add(name)?.checked_add(media_type)
    };
    needed().is_some_and(|needed| needed <= body.len())
}
