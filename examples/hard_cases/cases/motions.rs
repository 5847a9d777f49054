//! Fast and deep motions, and laws of friction.

use palpate::scene::LocalModelKind::{LinearBoundary, Patch, Predictive};

use super::{Case, case, run};

pub const CASES: &[Case] = &[
    case(
        "impact",
        "hard/impact",
        "the tool hits at 1 m/s",
        &[
            run(Patch, 0.0, [23.0, 112.0, 122.0, 43.0]),
            run(LinearBoundary, 0.0, [16.0, 109.0, 122.0, 42.0]),
            run(Predictive, 0.0, [1.2, 4.6, 121.0, 1.3]),
            run(Predictive, 1.0, [1.6, 7.9, 121.0, 1.7]),
        ],
    ),
    case(
        "impact seen",
        "hard/impact_seen",
        "the same, after 0.1 s in which the tool was seen coming",
        &[
            run(Patch, 0.0, [19.0, 112.0, 122.0, 43.0]),
            run(LinearBoundary, 0.0, [14.0, 109.0, 122.0, 42.0]),
            run(Predictive, 0.0, [0.46, 3.7, 121.0, 1.3]),
            run(Predictive, 1.0, [3.0, 14.0, 121.0, 1.7]),
        ],
    ),
    case(
        "teleport",
        "hard/teleport",
        "20 mm within one tick, and back",
        &[
            run(Patch, 0.0, [3.9, 38.0, 129.0, 8.5]),
            run(LinearBoundary, 0.0, [5.1, 38.0, 129.0, 8.5]),
            run(Predictive, 0.0, [0.42, 3.4, 121.0, 0.3]),
            run(Predictive, 1.0, [0.6, 3.4, 121.0, 0.3]),
        ],
    )
    .ends_free(),
    case(
        "half the body",
        "hard/half",
        "pressed to half the height: cells invert",
        &[
            run(Patch, 0.0, [20.0, 76.0, 20.0, 90.0]),
            run(LinearBoundary, 0.0, [11.0, 45.0, 7.7, 38.0]),
            run(Predictive, 0.0, [1.6, 6.7, 7.7, 5.0]),
            run(Predictive, 1.0, [4.7, 26.0, 7.8, 16.0]),
        ],
    )
    .ends_free(),
    case(
        "no friction",
        "hard/drag_slip",
        "friction 0, 0.1 m/s",
        &[
            run(Patch, 0.0, [13.0, 37.0, 11.0, 85.0]),
            run(LinearBoundary, 0.0, [13.0, 58.0, 9.9, 51.0]),
            run(Predictive, 0.0, [0.32, 1.3, 11.0, 2.1]),
            run(Predictive, 1.0, [0.64, 3.4, 11.0, 5.1]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.1 m/s",
        "hard/drag_100",
        "friction 0.3",
        &[
            run(Patch, 0.0, [19.0, 67.0, 15.0, 46.0]),
            run(LinearBoundary, 0.0, [15.0, 70.0, 15.0, 28.0]),
            run(Predictive, 0.0, [0.56, 7.6, 15.0, 1.2]),
            run(Predictive, 1.0, [0.91, 6.6, 15.0, 2.6]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.2 m/s",
        "hard/drag_200",
        "friction 0.3",
        &[
            run(Patch, 0.0, [21.0, 98.0, 21.0, 66.0]),
            run(LinearBoundary, 0.0, [19.0, 79.0, 20.0, 45.0]),
            run(Predictive, 0.0, [0.44, 2.1, 33.0, 1.4]),
            run(Predictive, 1.0, [1.7, 21.0, 31.0, 3.1]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.4 m/s",
        "hard/drag_400",
        "friction 0.3",
        &[
            run(Patch, 0.0, [22.0, 91.0, 26.0, 85.0]),
            run(LinearBoundary, 0.0, [20.0, 111.0, 27.0, 74.0]),
            run(Predictive, 1.0, [3.0, 26.0, 23.0, 1.9]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.6 m/s",
        "hard/drag_600",
        "friction 0.3, stops within 30 ms",
        &[run(LinearBoundary, 0.0, [14.0, 70.0, 35.0, 55.0]), run(Predictive, 1.0, [3.9, 29.0, 49.0, 1.9])],
    )
    .ends_free(),
    case(
        "stick",
        "hard/drag_stick",
        "unbounded friction: torn off at the lift",
        &[
            run(Patch, 0.0, [16.0, 75.0, 75.0, 43.0]),
            run(LinearBoundary, 0.0, [14.0, 75.0, 50.0, 11.0]),
            run(Predictive, 1.0, [4.7, 32.0, 56.0, 4.1]),
        ],
    )
    .ends_free(),
];
