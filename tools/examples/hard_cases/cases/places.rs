//! Degenerate places, and rest.

use palpate::model::local::Kind::{LinearBoundary, Patch, Predictive};

use super::{Case, case, run};

pub const CASES: &[Case] = &[
    case(
        "vertex",
        "hard/vertex",
        "contact exactly on a node",
        &[
            run(Patch, 0.0, [8.0, 29.0, 14.0, 36.0]),
            run(LinearBoundary, 0.0, [6.5, 29.0, 14.0, 26.0]),
            run(Predictive, 0.0, [0.11, 0.14, 14.0, 0.34]),
            run(Predictive, 1.0, [0.14, 0.23, 14.0, 0.45]),
        ],
    )
    .ends_free(),
    case(
        "edge",
        "hard/edge",
        "contact exactly on an edge of the mesh",
        &[
            run(Patch, 0.0, [9.1, 28.0, 17.0, 42.0]),
            run(LinearBoundary, 0.0, [6.3, 29.0, 17.0, 25.0]),
            run(Predictive, 0.0, [0.13, 0.21, 17.0, 0.39]),
            run(Predictive, 1.0, [0.19, 0.44, 17.0, 0.68]),
        ],
    )
    .ends_free(),
    case(
        "rim",
        "hard/rim",
        "contact exactly on the edge of the body",
        &[
            run(Patch, 0.0, [3.0, 11.0, 121.0, 5.6]),
            run(LinearBoundary, 0.0, [2.7, 12.0, 121.0, 4.6]),
            run(Predictive, 0.0, [0.13, 0.27, 121.0, 0.39]),
            run(Predictive, 1.0, [0.14, 0.31, 121.0, 0.37]),
        ],
    )
    .ends_free(),
    case(
        "corner",
        "hard/corner",
        "contact exactly on a corner of the body",
        &[
            run(Patch, 0.0, [3.0, 13.0, 121.0, 6.2]),
            run(LinearBoundary, 0.0, [1.4, 6.1, 121.0, 3.1]),
            run(Predictive, 1.0, [0.14, 0.25, 121.0, 0.44]),
        ],
    )
    .ends_free(),
    case(
        "along an edge",
        "hard/along_edge",
        "dragged exactly through edges and nodes",
        &[
            run(Patch, 0.0, [9.4, 28.0, 14.0, 24.0]),
            run(LinearBoundary, 0.0, [7.8, 32.0, 14.0, 14.0]),
            run(Predictive, 0.0, [0.12, 0.16, 15.0, 0.33]),
            run(Predictive, 1.0, [0.16, 0.31, 15.0, 0.43]),
        ],
    )
    .ends_free(),
    case(
        "over the rim",
        "hard/over_rim",
        "dragged off the top over the edge of the body",
        &[
            run(Patch, 0.0, [14.0, 93.0, 37.0, 14.0]),
            run(LinearBoundary, 0.0, [7.6, 69.0, 42.0, 9.5]),
            run(Predictive, 1.0, [0.22, 0.79, 56.0, 0.51]),
        ],
    ),
    case("rest", "hard/rest", "two minutes without a motion", &[run(Predictive, 1.0, [0.1, 0.11, 8.1, 0.3])]),
];
