//! Keys of one kind of body in a body of the other: refused by name before anything is read.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::fault::Fault;
use crate::scene::body::{BODY_KEYS, BodyKind, REGION_KEYS, misplaced};

/// The first such key in the order of the file.
pub(super) fn first_misplaced(root: &DeTable<'_>) -> Option<Fault> {
    let body = table(root.get("body")?)?;
    let kind = match body.get("kind").map(Spanned::get_ref) {
        None => BodyKind::default(),
        Some(DeValue::String(name)) => {
            [BodyKind::MassSpring, BodyKind::Tetrahedra].into_iter().find(|kind| kind.name() == name)?
        }
        Some(_) => return None,
    };
    let own = keys(body, |key| misplaced(key, kind, &BODY_KEYS));
    let regions = match body.get("region").map(Spanned::get_ref) {
        Some(DeValue::Array(regions)) => regions.iter().collect(),
        _ => Vec::new(),
    };
    let of_regions = regions.into_iter().enumerate().filter_map(|(index, region)| {
        let fault = keys(table(region)?, |key| misplaced(key, kind, &REGION_KEYS))?;
        Some(fault.under_index(index).under_key("region"))
    });
    own.into_iter().chain(of_regions).min_by_key(|fault| fault.offset).map(|fault| fault.under_key("body"))
}

fn table<'a, 'i>(value: &'a Spanned<DeValue<'i>>) -> Option<&'a DeTable<'i>> {
    match value.get_ref() {
        DeValue::Table(table) => Some(table),
        _ => None,
    }
}

/// The first key of `table` that something is wrong with.
fn keys(table: &DeTable<'_>, wrong: impl Fn(&str) -> Option<String>) -> Option<Fault> {
    let faults = table.iter().filter_map(|(key, _)| {
        let message = wrong(key.get_ref())?;
        Some(Fault::new(message).under_key(key.get_ref()).or_at(key.span().start))
    });
    faults.min_by_key(|fault| fault.offset)
}
