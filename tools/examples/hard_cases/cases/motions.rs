//! Fast and deep motions, and laws of friction.

use palpate::model::local::Kind::{LinearBoundary, Patch, Predictive};

use super::{Case, case, run};

pub const CASES: &[Case] = &[
    case(
        "impact",
        "hard/impact",
        "the tool hits at 1 m/s",
        &[
            run(Patch, 0.0, [23.0, 113.0, 122.0, 42.0]),
            run(LinearBoundary, 0.0, [16.0, 108.0, 122.0, 41.0]),
            run(Predictive, 0.0, [0.14, 0.32, 121.0, 0.33]),
            run(Predictive, 1.0, [0.21, 0.58, 121.0, 0.34]),
        ],
    ),
    case(
        "impact seen",
        "hard/impact_seen",
        "the same, after 0.1 s in which the tool was seen coming",
        &[
            run(Patch, 0.0, [19.0, 113.0, 122.0, 42.0]),
            run(LinearBoundary, 0.0, [13.0, 108.0, 122.0, 41.0]),
            run(Predictive, 0.0, [0.14, 0.42, 121.0, 0.38]),
            run(Predictive, 1.0, [0.19, 0.82, 121.0, 0.38]),
        ],
    ),
    case(
        "teleport",
        "hard/teleport",
        "20 mm within one tick, and back",
        &[
            run(Patch, 0.0, [3.9, 38.0, 129.0, 8.5]),
            run(LinearBoundary, 0.0, [5.1, 38.0, 129.0, 8.5]),
            run(Predictive, 0.0, [0.39, 4.4, 121.0, 0.3]),
            run(Predictive, 1.0, [0.4, 4.5, 121.0, 0.3]),
        ],
    )
    .ends_free(),
    case(
        "half the body",
        "hard/half",
        "pressed to half the height: cells invert",
        &[
            run(Patch, 0.0, [20.0, 76.0, 20.0, 89.0]),
            run(LinearBoundary, 0.0, [11.0, 45.0, 7.7, 39.0]),
            run(Predictive, 0.0, [0.71, 4.4, 7.5, 1.1]),
            run(Predictive, 1.0, [1.7, 7.4, 7.5, 3.4]),
        ],
    )
    .ends_free(),
    case(
        "no friction",
        "hard/drag_slip",
        "friction 0, 0.1 m/s",
        &[
            run(Patch, 0.0, [13.0, 37.0, 11.0, 85.0]),
            run(LinearBoundary, 0.0, [13.0, 59.0, 9.9, 52.0]),
            run(Predictive, 0.0, [0.12, 0.16, 11.0, 0.35]),
            run(Predictive, 1.0, [0.16, 0.44, 11.0, 0.64]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.1 m/s",
        "hard/drag_100",
        "friction 0.3",
        &[
            run(Patch, 0.0, [19.0, 67.0, 15.0, 46.0]),
            run(LinearBoundary, 0.0, [14.0, 70.0, 15.0, 29.0]),
            run(Predictive, 0.0, [0.12, 0.25, 15.0, 0.33]),
            run(Predictive, 1.0, [0.31, 5.0, 15.0, 0.45]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.2 m/s",
        "hard/drag_200",
        "friction 0.3",
        &[
            run(Patch, 0.0, [21.0, 97.0, 21.0, 65.0]),
            run(LinearBoundary, 0.0, [19.0, 78.0, 20.0, 45.0]),
            run(Predictive, 0.0, [0.13, 0.23, 32.0, 0.34]),
            run(Predictive, 1.0, [0.23, 0.96, 32.0, 0.55]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.4 m/s",
        "hard/drag_400",
        "friction 0.3",
        &[
            run(Patch, 0.0, [23.0, 91.0, 26.0, 85.0]),
            run(LinearBoundary, 0.0, [20.0, 110.0, 27.0, 74.0]),
            run(Predictive, 1.0, [2.8, 27.0, 27.0, 4.9]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.6 m/s",
        "hard/drag_600",
        "friction 0.3, stops within 30 ms",
        &[run(LinearBoundary, 0.0, [14.0, 70.0, 36.0, 54.0]), run(Predictive, 1.0, [3.6, 30.0, 49.0, 5.1])],
    )
    .ends_free(),
    case(
        "stick",
        "hard/drag_stick",
        "unbounded friction: torn off late in the lift",
        &[
            run(Patch, 0.0, [17.0, 75.0, 75.0, 43.0]),
            run(LinearBoundary, 0.0, [14.0, 75.0, 50.0, 11.0]),
            run(Predictive, 1.0, [3.3, 54.0, 35.0, 0.51]),
        ],
    ),
    case(
        "stick-slip",
        "hard/stick_slip",
        "0.8 to break loose, 0.4 to slide",
        &[
            run(Patch, 0.0, [16.0, 45.0, 37.0, 24.0]),
            run(LinearBoundary, 0.0, [5.0, 34.0, 32.0, 4.3]),
            run(Predictive, 0.0, [0.12, 0.21, 37.0, 0.33]),
            run(Predictive, 1.0, [0.14, 0.37, 37.0, 0.42]),
        ],
    )
    .ends_free(),
    case(
        "stick-slip, Stribeck",
        "hard/stick_slip_stribeck",
        "the same, falling over 10 mm/s",
        &[
            run(Patch, 0.0, [16.0, 52.0, 35.0, 20.0]),
            run(LinearBoundary, 0.0, [7.5, 36.0, 35.0, 3.0]),
            run(Predictive, 0.0, [0.14, 1.4, 19.0, 0.33]),
            run(Predictive, 1.0, [0.23, 3.4, 19.0, 0.41]),
        ],
    )
    .ends_free(),
];
