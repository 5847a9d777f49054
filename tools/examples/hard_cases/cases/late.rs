//! Results that come late, get lost, or stop coming.

use palpate::model::local::Kind::{LinearBoundary, Patch, Predictive};

use super::{Case, Upset, case, run};

pub const CASES: &[Case] = &[
    case(
        "late hand",
        "hand",
        "results 1.5 and 2 periods late",
        &[
            run(Patch, 1.5, [52.0, 140.0, 8.2, 339.0]),
            run(Patch, 2.0, [64.0, 157.0, 9.7, 292.0]),
            run(LinearBoundary, 1.5, [43.0, 105.0, 7.6, 312.0]),
            run(LinearBoundary, 2.0, [52.0, 113.0, 9.2, 290.0]),
            run(Predictive, 1.5, [0.22, 0.6, 2.4, 0.32]),
            run(Predictive, 2.0, [0.34, 1.2, 2.4, 0.39]),
        ],
    ),
    case(
        "late drag",
        "hard/drag_100",
        "results 1.5 and 2 periods late",
        &[run(Predictive, 1.5, [0.25, 0.63, 15.0, 0.54]), run(Predictive, 2.0, [0.37, 4.3, 15.0, 0.72])],
    )
    .ends_free(),
    case(
        "lost hand",
        "hand",
        "every second resync is lost",
        &[
            run(Patch, 1.0, [46.0, 102.0, 6.8, 280.0]),
            run(LinearBoundary, 1.0, [41.0, 104.0, 8.6, 292.0]),
            run(Predictive, 1.0, [0.69, 3.4, 2.4, 0.63]),
        ],
    )
    .upset(Upset::EverySecondLost),
    case(
        "lost drag 0.1 m/s",
        "hard/drag_100",
        "every second resync is lost",
        &[run(Predictive, 1.0, [0.49, 5.0, 15.0, 0.42])],
    )
    .ends_free()
    .upset(Upset::EverySecondLost),
    case(
        "lost drag 0.2 m/s",
        "hard/drag_200",
        "every second resync is lost",
        &[run(Predictive, 1.0, [0.48, 3.0, 32.0, 0.72])],
    )
    .ends_free()
    .upset(Upset::EverySecondLost),
    case(
        "stalled hand",
        "hard/hand_long",
        "the global model stands still for 1 s",
        &[
            run(Patch, 1.0, [37.0, 113.0, 7.4, 340.0]),
            run(LinearBoundary, 1.0, [32.0, 83.0, 7.2, 273.0]),
            run(Predictive, 1.0, [4.8, 19.0, 5.7, 1.3]),
        ],
    )
    .upset(Upset::Stall(0.5)),
    // `full` itself jumps by 11.7 % as the tool is lifted.
    case(
        "stalled drag",
        "hard/drag_long",
        "the global model stands still for 1 s",
        &[run(LinearBoundary, 1.0, [44.0, 130.0, 11.0, 66.0]), run(Predictive, 1.0, [2.0, 19.0, 15.0, 2.1])],
    )
    .ends_free()
    .upset(Upset::Stall(0.4)),
];
