//! Materials and shapes.

use palpate::model::local::Kind::{LinearBoundary, Patch, Predictive};

use super::{Case, Setup, case, run};

pub const CASES: &[Case] = &[
    case(
        "damping low",
        "hard/damping_low",
        "damping ratio 0.001",
        &[
            run(Patch, 0.0, [36.0, 108.0, 41.0, 110.0]),
            run(LinearBoundary, 0.0, [7.2, 30.0, 4.4, 15.0]),
            run(Predictive, 0.0, [0.11, 0.13, 2.4, 0.32]),
            run(Predictive, 1.0, [0.17, 0.4, 2.4, 0.41]),
        ],
    ),
    case(
        "damping high",
        "hard/damping_high",
        "damping ratio 2",
        &[
            run(Patch, 0.0, [18.0, 44.0, 5.8, 81.0]),
            run(LinearBoundary, 0.0, [8.4, 33.0, 6.5, 22.0]),
            run(Predictive, 0.0, [0.12, 0.15, 2.4, 0.31]),
            run(Predictive, 1.0, [0.21, 0.53, 2.4, 0.42]),
        ],
    ),
    case(
        "stiff x 10",
        "hard/stiff_10",
        "springs of 300 N/m",
        &[
            run(Patch, 0.0, [9.9, 28.0, 4.2, 78.0]),
            run(LinearBoundary, 0.0, [5.3, 19.0, 3.2, 22.0]),
            run(Predictive, 0.0, [0.13, 0.2, 2.3, 0.36]),
            run(Predictive, 1.0, [0.25, 0.66, 2.3, 0.78]),
        ],
    ),
    case(
        "stiff x 100",
        "hard/stiff_100",
        "springs of 3000 N/m: implicit linear patches",
        &[
            run(Patch, 0.0, [9.7, 28.0, 4.2, 78.0]),
            run(LinearBoundary, 0.0, [5.1, 18.0, 3.2, 21.0]),
            run(Predictive, 0.0, [0.13, 0.21, 2.3, 0.38]),
            run(Predictive, 1.0, [0.25, 0.67, 2.3, 0.79]),
        ],
    ),
    Case {
        body: Setup::UnequalMasses,
        ..case(
            "masses 1:1000",
            "",
            "neighbours of 0.5 g and 0.5 mg",
            &[
                run(Patch, 0.0, [13.0, 29.0, 4.0, 26.0]),
                run(LinearBoundary, 0.0, [6.5, 21.0, 2.5, 12.0]),
                run(Predictive, 0.0, [0.14, 0.22, 1.8, 0.37]),
                run(Predictive, 1.0, [0.38, 1.1, 1.8, 0.78]),
            ],
        )
    },
    case(
        "sliver 1:10",
        "hard/sliver_10",
        "triangles ten times as long as wide",
        &[
            run(Patch, 0.0, [25.0, 94.0, 40.0, 8.1]),
            run(LinearBoundary, 0.0, [17.0, 91.0, 89.0, 18.0]),
            run(Predictive, 0.0, [0.11, 0.11, 106.0, 0.3]),
            // As `full` itself jumps.
            run(Predictive, 1.0, [0.11, 0.11, 89.0, 0.31]),
        ],
    ), // The ribbon bends away: at the end the tool hangs under its edge.
    case(
        "sliver 1:100",
        "hard/sliver_100",
        "a hundred times; the ribbon buckles",
        &[
            run(Patch, 0.0, [38.0, 228.0, 76.0, 234.0]),
            run(LinearBoundary, 0.0, [9.2, 132.0, 81.0, 22.0]),
            run(Predictive, 0.0, [0.11, 0.11, 120.0, 0.31]),
            run(Predictive, 1.0, [0.11, 0.11, 120.0, 0.31]),
        ],
    )
    .ends_free(),
    case(
        "flat sheet",
        "hard/flat",
        "1 mm high, cells 27 times as wide as high",
        &[
            run(Patch, 0.0, [11.0, 46.0, 138.0, 69.0]),
            run(LinearBoundary, 0.0, [7.7, 46.0, 109.0, 42.0]),
            run(Predictive, 0.0, [0.11, 0.16, 112.0, 0.31]),
            run(Predictive, 1.0, [0.11, 0.16, 112.0, 0.31]),
        ],
    )
    .ends_free(),
];
