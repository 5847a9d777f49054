//! The map of a face for a terminal: a digit for each contact.

use super::figures::figure;
use crate::reduce::findings::{FaceMap, Locality};

/// Errors (%) at which the next digit begins.
const STEPS: [f64; 9] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
/// Contacts that fit a line.
const MOST: usize = 45;

/// What the digits mean.
pub(super) fn legend() -> String {
    let steps: Vec<String> = STEPS.iter().enumerate().map(|(at, step)| format!("{} from {step}", at + 1)).collect();
    format!("Digits: 0 below {}, {} %; . held; the contact in [ ].", STEPS[0], steps.join(", "))
}

/// The faces with the contact first, and the top before others.
pub(super) fn faces(locality: &Locality) -> Vec<&FaceMap> {
    let has_contact = |face: &FaceMap| face.contacts.iter().flatten().any(|c| c.node == locality.contact.node);
    let mut faces: Vec<&FaceMap> = locality.faces.iter().collect();
    faces.sort_by_key(|face| (!has_contact(face), face.face != "z_max"));
    faces
}

/// Errors between resyncs on `face`, the second axis upwards, every line ended by a newline.
pub(super) fn map(face: &FaceMap, contact: u32) -> String {
    let (wide, high) = (face.first_m.len(), face.second_m.len());
    let every = wide.max(high).div_ceil(MOST).max(1);
    let ends = |[from, to]: [f64; 2]| format!("{} to {} mm", figure(1e3 * from), figure(1e3 * to));
    let mut text = format!(
        "Error between resyncs on {}, {} to the right ({}), {} upwards ({})",
        face.face,
        face.axes[0],
        ends(face.ends_m[0]),
        face.axes[1],
        ends(face.ends_m[1])
    );
    if every > 1 {
        text.push_str(&format!(", each digit the worst of {every} x {every}"));
    }
    text = super::table::wrapped(&text);
    for row in (0..high.div_ceil(every)).rev() {
        let mut line = String::from("   ");
        let mut is_open = false;
        for column in 0..wide.div_ceil(every) {
            let cells = || {
                let rows = row * every..((row + 1) * every).min(high);
                let columns = column * every..((column + 1) * every).min(wide);
                let at = rows.flat_map(move |row| columns.clone().map(move |column| row * wide + column));
                at.filter_map(|at| face.contacts.get(at)?.as_ref())
            };
            let is_here = cells().any(|cell| cell.node == contact);
            line.push(if is_here {
                '['
            } else if is_open {
                ']'
            } else {
                ' '
            });
            line.push(cells().map(|cell| digit(cell.band_pct)).max().unwrap_or('.'));
            is_open = is_here;
        }
        if is_open {
            line.push(']');
        }
        text.push_str(&line);
        text.push('\n');
    }
    text
}

/// An error as a digit; `?` for none.
fn digit(error_pct: f64) -> char {
    if error_pct.is_nan() {
        return '?';
    }
    let digit = STEPS.iter().filter(|step| error_pct >= **step).count();
    char::from_digit(digit as u32, 10).unwrap_or('9')
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::*;

    #[test]
    fn the_map_has_a_digit_for_each_contact_and_shows_where_the_tool_is() {
        let locality = sample().locality.unwrap();
        let map = map(faces(&locality)[0], locality.contact.node);
        let lines: Vec<&str> = map.lines().collect();
        assert_eq!((lines.len(), lines[12]), (13, "    2 2 2 2 2 2 2 2 2 2 2 2"), "{map}");
        // Node 66 is the seventh of the sixth row from below; the nodule is one to the right and one above.
        assert_eq!((lines[7], lines[6]), ("    2 2 2 3 5 6[7]7 7 6 5 3", "    2 2 2 3 5 6 7 8 7 6 5 3"), "{map}");
    }

    #[test]
    fn the_face_of_the_contact_comes_first_and_then_the_top() {
        let mut locality = sample().locality.unwrap();
        let names = |locality: &Locality| faces(locality).iter().map(|face| face.face.clone()).collect::<Vec<_>>();
        locality.faces.reverse();
        let top_first = names(&locality);
        assert_eq!(top_first[0], "z_max");
        locality.contact.node = u32::MAX;
        assert_eq!(names(&locality), top_first, "a contact that is on none of them");
        let side = locality.faces.iter_mut().find(|face| face.face != "z_max").unwrap();
        side.contacts.iter_mut().flatten().for_each(|contact| contact.node = u32::MAX);
        let side = side.face.clone();
        assert_eq!(names(&locality)[0], side);
    }

    #[test]
    fn held_nodes_are_dots_and_large_maps_show_the_worst() {
        let mut face = sample().locality.unwrap().faces.remove(1);
        assert_eq!(map(&face, u32::MAX).lines().last().unwrap(), format!("   {}", " .".repeat(12)));
        face.ends_m = [[-0.5e-3, 89.5e-3], [0.0, 1e-3]];
        face.first_m = (0..90).map(|at| f64::from(at) * 1e-3).collect();
        face.second_m = vec![0.0, 1e-3];
        face.contacts = vec![face.contacts[20]; 180];
        let last = face.contacts.last_mut().unwrap().as_mut().unwrap();
        last.band_pct = 99.0;
        let text = map(&face, u32::MAX);
        assert!(text.contains("worst of 2 x 2") && text.ends_with(" 9\n"), "{text}");
        assert!(text.contains("(-0.500 to 89.5 mm)"), "the ends of the body: {text}");
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    }

    #[test]
    fn digits_begin_at_their_steps() {
        assert_eq!([0.0, 0.0999, 0.1, 49.9, 1e9, f64::NAN].map(digit), ['0', '0', '1', '8', '9', '?']);
        assert!(legend().contains("9 from 50 %"), "{}", legend());
    }
}
