//! The known word that a misspelt one probably means.

use strsim::osa_distance;

/// Shortest word that counts as meant when it is part of another.
const SHORTEST_PART: usize = 3;
/// Longest word that a known one is looked for in (bytes).
const LONGEST: usize = 64;

/// The entry of `known` that `word` probably means: the same without or with another unit or prefix, or a few slips of
/// the finger away.
pub(super) fn suggest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    // The distance costs the product of the lengths, and nobody means a short word by so long a one.
    if word.len() > LONGEST {
        return None;
    }
    let word = word.to_lowercase().replace('-', "_");
    let tolerated = (word.chars().count() / 3).max(1);
    let near =
        known.iter().map(|&name| (osa_distance(&word, name), name)).min().filter(|&(slips, _)| slips <= tolerated);
    let part = || {
        let holds = |long: &str, short: &str| short.len() >= SHORTEST_PART && long.contains(short);
        known
            .iter()
            .copied()
            .find(|name| holds(name, &word) || holds(&word, stem(name)) || holds(stem(name), stem(&word)))
    };
    near.map(|(_, name)| name).or_else(part)
}

/// A key without the unit behind it: `size` of `size_m`, `stiffness` of `stiffness_n_per_m`.
fn stem(key: &str) -> &str {
    const UNITS: [&str; 13] =
        ["_n_per_mm", "_n_per_ms", "_n_per_m", "_per_ms", "_mm", "_cm", "_ms", "_hz", "_kg", "_g", "_m", "_n", "_s"];
    UNITS.iter().find_map(|unit| key.strip_suffix(unit)).unwrap_or(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MATERIAL: [&str; 3] = ["node_mass_kg", "stiffness_n_per_m", "damping_ratio"];

    #[test]
    fn a_slip_a_missing_unit_and_a_wrong_unit_are_understood() {
        for (word, meant) in [
            ("stiffness", "stiffness_n_per_m"),
            ("stifness_n_per_m", "stiffness_n_per_m"),
            ("stiffness_n_per_mm", "stiffness_n_per_m"),
            ("Damping-Ratio", "damping_ratio"),
            ("mass_g", "node_mass_kg"),
            ("damping", "damping_ratio"),
            ("dampign_ratio", "damping_ratio"),
        ] {
            assert_eq!(suggest(word, &MATERIAL), Some(meant), "{word}");
        }
        assert_eq!(suggest("size_mm", &["nodes", "size_m", "fixed"]), Some("size_m"));
    }

    #[test]
    fn an_unrelated_word_gets_no_suggestion() {
        assert_eq!(suggest("colour", &MATERIAL), None);
        assert_eq!(suggest("x", &MATERIAL), None);
        assert_eq!(suggest("", &MATERIAL), None);
        assert_eq!(suggest("colour", &[]), None);
    }

    #[test]
    fn a_swap_of_neighbours_is_one_slip() {
        assert_eq!(osa_distance("ab", "ba"), 1);
        assert_eq!(osa_distance("kitten", "sitting"), 3);
        assert_eq!(osa_distance("", "abc"), 3);
    }
}
