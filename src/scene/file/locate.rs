//! From a dotted field to its line in a scene file, and back from a place to the table around it.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::fault::plain_key;

/// The line, counted from 1, on which byte `offset` of `text` lies.
pub(super) fn line_of(text: impl AsRef<[u8]>, offset: usize) -> usize {
    let text = text.as_ref();
    let before = &text[..offset.min(text.len())];
    1 + before.iter().filter(|&&byte| byte == b'\n').count()
}

/// The byte offset of `field` (such as `body.block.nodes` or `probe[1].node`), or of the innermost table of its path
/// that the document has; 0 if it has none.
pub(super) fn offset_of(root: &DeTable<'_>, field: &str) -> usize {
    walk(root, field).0
}

/// The byte offset of `field` if the document has exactly that.
pub(super) fn exact_offset_of(root: &DeTable<'_>, field: &str) -> Option<usize> {
    let (offset, is_exact) = walk(root, field);
    is_exact.then_some(offset)
}

/// As far along `field` as the document goes, and whether that is all of it.
fn walk(root: &DeTable<'_>, field: &str) -> (usize, bool) {
    let mut table = root;
    let mut offset = 0;
    let mut steps = field.split('.');
    while let Some(step) = steps.next() {
        let (key, index) = split_index(step);
        let Some((spanned_key, value)) = table.iter().find(|(name, _)| name.get_ref() == key) else {
            return (offset, false);
        };
        let value = match (index, value.get_ref()) {
            (Some(index), DeValue::Array(items)) => items.get(index).unwrap_or(value),
            _ => value,
        };
        // A table's place is its header; a value's is its key, which stands on the line that a user looks for.
        let is_section = matches!(value.get_ref(), DeValue::Table(_)) || index.is_some();
        offset = if is_section { value.span().start } else { spanned_key.span().start };
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => return (offset, steps.next().is_none()),
        }
    }
    (offset, true)
}

/// `probe[1]` as `probe` and 1.
fn split_index(step: &str) -> (&str, Option<usize>) {
    step.strip_suffix(']')
        .and_then(|step| step.split_once('['))
        .and_then(|(key, index)| Some((key, Some(index.parse().ok()?))))
        .unwrap_or((step, None))
}

/// The dotted path of the innermost table in which byte `offset` lies; empty for the top.
pub(super) fn table_at(root: &DeTable<'_>, offset: usize) -> String {
    let mut sections = Vec::new();
    collect(root, "", &mut sections);
    let inline = sections.iter().filter(|(span, _)| span.contains(&offset)).min_by_key(|(span, _)| span.len());
    let header = || {
        sections.iter().filter(|(span, _)| span.start <= offset && !span.is_empty()).max_by_key(|(span, _)| span.start)
    };
    inline.or_else(header).map(|(_, path)| path.clone()).unwrap_or_default()
}

fn collect(table: &DeTable<'_>, path: &str, sections: &mut Vec<(Range<usize>, String)>) {
    for (key, value) in table.iter() {
        let key = plain_key(key.get_ref());
        let path = if path.is_empty() { key } else { format!("{path}.{key}") };
        collect_value(value, path, sections);
    }
}

fn collect_value(value: &Spanned<DeValue<'_>>, path: String, sections: &mut Vec<(Range<usize>, String)>) {
    match value.get_ref() {
        DeValue::Table(inner) => {
            sections.push((value.span(), path.clone()));
            collect(inner, &path, sections);
        }
        DeValue::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                collect_value(item, format!("{path}[{index}]"), sections);
            }
        }
        _ => {}
    }
}
