//! Tool paths: interpolation and the CSV form.

use palpate::devices::ToolPath;
use palpate::runtime::Nanos;
use proptest::prelude::*;

const HEADER: &str = "t_s,x_m,y_m,z_m\n";

fn samples() -> impl Strategy<Value = (Vec<f64>, Vec<[f64; 3]>)> {
    let step = (1_u64..50_000_000, prop::array::uniform3(-0.5..0.5_f64));
    (0_u64..1_000_000_000, prop::collection::vec(step, 1..50)).prop_map(|(start, steps)| {
        let mut now = start;
        steps
            .into_iter()
            .map(|(pause, position)| {
                now += pause;
                (Nanos(now).as_secs_f64(), position)
            })
            .unzip()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Check that a sample's own time gives its own value to the last bit.
    #[test]
    fn a_path_goes_exactly_through_its_samples((times, positions) in samples()) {
        let path = ToolPath::new(times.clone(), positions.clone()).unwrap();
        for (time, position) in times.iter().zip(&positions) {
            prop_assert_eq!(path.at(*time), *position);
        }
    }

    /// Check that between two samples the tool is between their positions, at the share of the time that has passed.
    #[test]
    fn a_path_is_linear_between_samples((times, positions) in samples(), share in 0.0..1.0_f64) {
        let path = ToolPath::new(times.clone(), positions.clone()).unwrap();
        for (t, p) in times.windows(2).zip(positions.windows(2)) {
            let here = path.at(t[0] + share * (t[1] - t[0]));
            for axis in 0..3 {
                let expected = p[0][axis] + share * (p[1][axis] - p[0][axis]);
                // The time itself is rounded: one part in 1e9 of a step of 1 ns and more.
                prop_assert!((here[axis] - expected).abs() <= 1e-6, "{} {}", here[axis], expected);
                let (low, high) = (p[0][axis].min(p[1][axis]), p[0][axis].max(p[1][axis]));
                prop_assert!((low - 1e-15..=high + 1e-15).contains(&here[axis]));
            }
        }
    }

    /// Check that the tool stands still outside the path, for any time at all.
    #[test]
    fn a_path_is_held_before_and_after((times, positions) in samples(), time in prop::num::f64::ANY) {
        let path = ToolPath::new(times.clone(), positions.clone()).unwrap();
        let here = path.at(time);
        prop_assert!(here.iter().all(|value| value.is_finite()));
        if time <= times[0] {
            prop_assert_eq!(here, positions[0]);
        }
        if time >= path.duration_s() {
            prop_assert_eq!(here, positions[positions.len() - 1]);
        }
    }

    /// Check that printing and reading a path loses nothing, with either line ending.
    #[test]
    fn a_path_survives_its_csv_form((times, positions) in samples(), windows in any::<bool>(), last in any::<bool>()) {
        let end = if windows { "\r\n" } else { "\n" };
        let rows: Vec<String> =
            times.iter().zip(&positions).map(|(t, [x, y, z])| format!("{t},{x},{y},{z}")).collect();
        let text = format!("t_s,x_m,y_m,z_m{end}{}{}", rows.join(end), if last { end } else { "" });
        prop_assert_eq!(ToolPath::from_csv(&text, "p.csv").unwrap(), ToolPath::new(times, positions).unwrap());
    }

    /// Check that no text makes the reader panic or speak in several lines.
    #[test]
    fn a_mangled_path_file_gives_at_most_one_line(text in "(t_s,x_m,y_m,z_m\n)?([-0-9a-z.,\\r\\t ]{0,30}\n?){0,5}") {
        if let Err(error) = ToolPath::from_csv(&text, "p.csv") {
            let message = error.to_string();
            prop_assert!(message.starts_with("p.csv:") && !message.chars().any(char::is_control), "{message:?}");
        }
    }
}

#[test]
fn a_millisecond_tick_meets_the_row_of_its_time() {
    let rows: String = (0..=1000).map(|row| format!("{},{row},0,0\n", f64::from(row) / 1000.0)).collect();
    let path = ToolPath::from_csv(&format!("{HEADER}{rows}"), "p.csv").unwrap();
    for tick in 0..=1000_u32 {
        let time_s = Nanos(u64::from(tick) * 1_000_000).as_secs_f64();
        assert_eq!(path.at(time_s)[0], f64::from(tick));
    }
}

#[test]
fn a_constant_path_stays() {
    let path = ToolPath::constant([1.0, 2.0, 3.0]).unwrap();
    assert_eq!(path.duration_s(), 0.0);
    for time_s in [-1.0, 0.0, 1e-9, 5.0, f64::INFINITY, f64::NAN] {
        assert_eq!(path.at(time_s), [1.0, 2.0, 3.0]);
    }
}

#[test]
fn bad_rows_are_named_with_their_line() {
    for (text, expected) in [
        (
            "",
            "p.csv:1: found no header, must be exactly t_s,x_m,y_m,z_m (seconds and metres), or t_s,x_m,y_m,z_m,qw,qx,qy,qz",
        ),
        ("t_s,x_mm,y_mm,z_mm\n0,0,0,0\n", "p.csv:1: found the header \"t_s,x_mm,y_mm,z_mm\", must be exactly"),
        ("0,0,0,0\n", "p.csv:1: found the header \"0,0,0,0\""),
        ("t_s,x_m,y_m,z_m\n", "p.csv:1: the header has no row below it"),
        ("t_s,x_m,y_m,z_m\n0,0,0\n", "p.csv:2: found 3 columns, must be 4"),
        ("t_s,x_m,y_m,z_m\n0,0,0,0\n1,0,0,0,0\n", "p.csv:3: found 5 columns, must be 4"),
        ("t_s,x_m,y_m,z_m\r\n0,0,0,0\r\n1,left,0,0\r\n", "p.csv:3: x_m is \"left\", must be a number"),
        ("t_s,x_m,y_m,z_m\n0,0,0,\n", "p.csv:2: z_m is \"\", must be a number"),
        ("t_s,x_m,y_m,z_m\n0,0,0,nan\n", "p.csv:2: z_m is NaN, must be a finite number"),
        ("t_s,x_m,y_m,z_m\n0,0,1e999,0\n", "p.csv:2: y_m is inf, must be a finite number"),
        ("t_s,x_m,y_m,z_m\ninf,0,0,0\n", "p.csv:2: t_s is inf, must be a finite number"),
        ("t_s,x_m,y_m,z_m\n0,0,0,0\n\n1,0,0,0\n", "p.csv:3: the line is empty"),
        ("t_s,x_m,y_m,z_m\n-1,0,0,0\n", "p.csv:2: t_s is -1, a path starts at 0 or later"),
        ("t_s,x_m,y_m,z_m\n0,0,0,0\n2,0,0,0\n1,0,0,0\n", "p.csv:4: t_s is 1 after 2, times must increase"),
        ("t_s,x_m,y_m,z_m\n1,0,0,0\n1,0,0,0\n", "p.csv:3: t_s is 1 after 1, times must increase"),
        ("t_s,x_m,y_m,z_m\n0,0,0,1e9\n", "p.csv:2: z_m is 1000000000, must lie within 1000000 m"),
        ("t_s,x_m,y_m,z_m\n0,0,0,\u{1b}[2J\n", "p.csv:2: z_m is \"\\u{1b}[2J\", must be a number"),
    ] {
        let message = ToolPath::from_csv(text, "p.csv").expect_err(text).to_string();
        assert!(message.starts_with(expected), "{text:?} gives {message}");
    }
}

#[test]
fn a_path_made_by_a_program_is_checked_in_the_same_way() {
    let origin = [0.0; 3];
    for (times, positions, expected) in [
        (vec![], vec![], "no sample"),
        (vec![0.0], vec![origin, origin], "1 times and 2 positions"),
        (vec![0.0, 0.0], vec![origin, origin], "sample 1: t_s is 0 after 0"),
        (vec![f64::NAN], vec![origin], "sample 0: t_s is NaN"),
        (vec![0.0], vec![[0.0, f64::INFINITY, 0.0]], "sample 0: y_m is inf"),
        (vec![-0.5], vec![origin], "sample 0: t_s is -0.5"),
    ] {
        let message = ToolPath::new(times, positions).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
}
