//! The hard cases: what is simulated, what goes wrong with it, and how far each model may be from `full`.

use palpate::scene::LocalModelKind::{self, LinearBoundary, Patch, Predictive};

/// A situation in which simulations usually fail.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub name: &'static str,
    pub body: Setup,
    /// What is hard about it.
    pub hard: &'static str,
    pub upset: Upset,
    /// The tool has left the body at the end: the force must be gone.
    pub ends_free: bool,
    pub runs: &'static [Run],
}

/// Where body and tool come from.
#[derive(Clone, Copy, Debug)]
pub enum Setup {
    /// A file in `scenes`, without its extension.
    Scene(&'static str),
    /// A network of springs whose neighbours have 0.5 g and 0.5 mg.
    UnequalMasses,
}

/// What goes wrong with the global model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Upset {
    Nothing,
    /// The release at this time (s) takes a second.
    Stall(f64),
    /// Every second release does not happen.
    EverySecondLost,
}

/// One model in a case.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    pub model: LocalModelKind,
    /// How late results of the global model are, in its periods.
    pub late: f64,
    pub at_most: Bound,
}

/// The largest errors that are accepted, as in `ModelError` (% of the peak of `full`, or of its energy).
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    pub rms: f64,
    pub max: f64,
    pub jump: f64,
    pub energy: f64,
}

const fn run(model: LocalModelKind, late: f64, [rms, max, jump, energy]: [f64; 4]) -> Run {
    Run { model, late, at_most: Bound { rms, max, jump, energy } }
}

const fn case(name: &'static str, scene: &'static str, hard: &'static str, runs: &'static [Run]) -> Case {
    Case { name, body: Setup::Scene(scene), hard, upset: Upset::Nothing, ends_free: false, runs }
}

impl Case {
    const fn upset(self, upset: Upset) -> Self {
        Self { upset, ..self }
    }

    const fn ends_free(self) -> Self {
        Self { ends_free: true, ..self }
    }
}

/// All hard cases. A bound is the measured error, a fifth of it and a tenth of a percent (energy: three tenths).
pub const CASES: &[Case] = &[
    case(
        "damping low",
        "hard/damping_low",
        "damping ratio 0.001",
        &[
            run(Patch, 0.0, [36.0, 108.0, 41.0, 110.0]),
            run(LinearBoundary, 0.0, [7.1, 30.0, 4.4, 15.0]),
            run(Predictive, 0.0, [0.28, 0.79, 2.4, 0.71]),
            run(Predictive, 1.0, [0.63, 1.7, 2.5, 0.33]),
        ],
    ),
    case(
        "damping high",
        "hard/damping_high",
        "damping ratio 2",
        &[
            run(Patch, 0.0, [18.0, 44.0, 5.7, 81.0]),
            run(LinearBoundary, 0.0, [8.4, 33.0, 6.5, 22.0]),
            run(Predictive, 0.0, [0.28, 0.71, 2.4, 0.93]),
            run(Predictive, 1.0, [0.56, 1.3, 2.4, 1.8]),
        ],
    ),
    case(
        "stiff x 10",
        "hard/stiff_10",
        "springs of 300 N/m",
        &[
            run(Patch, 0.0, [9.8, 28.0, 4.2, 78.0]),
            run(LinearBoundary, 0.0, [5.2, 19.0, 3.2, 21.0]),
            run(Predictive, 0.0, [0.26, 0.61, 2.3, 0.42]),
            run(Predictive, 1.0, [0.45, 1.1, 2.3, 1.5]),
        ],
    ),
    case(
        "stiff x 100",
        "hard/stiff_100",
        "springs of 3000 N/m: implicit linear patches",
        &[
            run(Patch, 0.0, [9.7, 28.0, 4.1, 78.0]),
            run(LinearBoundary, 0.0, [5.1, 18.0, 3.1, 21.0]),
            run(Predictive, 0.0, [0.26, 0.56, 2.3, 0.33]),
            run(Predictive, 1.0, [0.42, 1.1, 2.3, 1.2]),
        ],
    ),
    Case {
        body: Setup::UnequalMasses,
        ..case(
            "masses 1:1000",
            "",
            "neighbours of 0.5 g and 0.5 mg",
            &[run(Patch, 0.0, [13.0, 29.0, 4.0, 26.0]), run(LinearBoundary, 0.0, [6.5, 21.0, 2.4, 12.0])],
        )
    },
    case(
        "sliver 1:10",
        "hard/sliver_10",
        "triangles ten times as long as wide",
        &[
            run(Patch, 0.0, [74.0, 368.0, 347.0, 149.0]),
            run(LinearBoundary, 0.0, [30.0, 280.0, 281.0, 53.0]),
            run(Predictive, 0.0, [2.1, 20.0, 78.0, 1.8]),
            run(Predictive, 1.0, [15.0, 84.0, 110.0, 4.1]),
        ],
    )
    .ends_free(),
    case(
        "sliver 1:100",
        "hard/sliver_100",
        "a hundred times; the ribbon buckles",
        &[
            run(Patch, 0.0, [27.0, 214.0, 116.0, 570.0]),
            run(LinearBoundary, 0.0, [24.0, 180.0, 24.0, 420.0]),
            run(Predictive, 0.0, [11.0, 130.0, 25.0, 110.0]),
            run(Predictive, 1.0, [23.0, 200.0, 110.0, 380.0]),
        ],
    )
    .ends_free(),
    case(
        "impact",
        "hard/impact",
        "the tool hits at 1 m/s",
        &[
            run(Patch, 0.0, [23.0, 113.0, 122.0, 42.0]),
            run(LinearBoundary, 0.0, [16.0, 108.0, 122.0, 41.0]),
            run(Predictive, 0.0, [12.0, 51.0, 130.0, 1.3]),
            run(Predictive, 1.0, [26.0, 65.0, 130.0, 1.6]),
        ],
    ),
    case(
        "teleport",
        "hard/teleport",
        "20 mm within one tick, and back",
        &[
            run(Patch, 0.0, [3.8, 38.0, 129.0, 8.2]),
            run(LinearBoundary, 0.0, [5.0, 38.0, 129.0, 8.2]),
            run(Predictive, 0.0, [0.41, 3.4, 130.0, 0.3]),
            run(Predictive, 1.0, [0.6, 3.4, 130.0, 0.3]),
        ],
    )
    .ends_free(),
    case(
        "half the body",
        "hard/half",
        "pressed to half the height: cells invert",
        &[
            run(Patch, 0.0, [20.0, 76.0, 20.0, 89.0]),
            run(LinearBoundary, 0.0, [11.0, 45.0, 7.7, 38.0]),
            run(Predictive, 0.0, [1.1, 5.9, 7.5, 2.4]),
            run(Predictive, 1.0, [5.1, 19.0, 7.5, 16.0]),
        ],
    )
    .ends_free(),
    case(
        "vertex",
        "hard/vertex",
        "contact exactly on a node",
        &[
            run(Patch, 0.0, [7.9, 29.0, 14.0, 36.0]),
            run(LinearBoundary, 0.0, [6.4, 29.0, 14.0, 26.0]),
            run(Predictive, 0.0, [0.39, 1.8, 14.0, 1.4]),
            run(Predictive, 1.0, [0.71, 3.7, 14.0, 2.6]),
        ],
    )
    .ends_free(),
    case(
        "edge",
        "hard/edge",
        "contact exactly on an edge of the mesh",
        &[
            run(Patch, 0.0, [9.1, 28.0, 17.0, 42.0]),
            run(LinearBoundary, 0.0, [6.2, 29.0, 17.0, 25.0]),
            run(Predictive, 0.0, [0.62, 3.2, 17.0, 2.2]),
            run(Predictive, 1.0, [1.1, 5.7, 17.0, 3.7]),
        ],
    )
    .ends_free(),
    case(
        "rim",
        "hard/rim",
        "contact exactly on the edge of the body",
        &[
            run(Patch, 0.0, [3.0, 11.0, 121.0, 5.4]),
            run(LinearBoundary, 0.0, [2.6, 12.0, 121.0, 4.4]),
            run(Predictive, 0.0, [0.58, 2.5, 130.0, 2.7]),
            run(Predictive, 1.0, [1.5, 4.7, 130.0, 6.8]),
        ],
    )
    .ends_free(),
    case(
        "along an edge",
        "hard/along_edge",
        "dragged exactly through edges and nodes",
        &[
            run(Patch, 0.0, [9.3, 28.0, 14.0, 24.0]),
            run(LinearBoundary, 0.0, [7.7, 32.0, 14.0, 14.0]),
            run(Predictive, 0.0, [0.26, 0.64, 15.0, 0.71]),
            run(Predictive, 1.0, [1.1, 4.2, 15.0, 1.6]),
        ],
    )
    .ends_free(),
    case(
        "no friction",
        "hard/drag_slip",
        "friction 0, 0.1 m/s",
        &[
            run(Patch, 0.0, [13.0, 37.0, 11.0, 85.0]),
            run(LinearBoundary, 0.0, [13.0, 59.0, 9.8, 51.0]),
            run(Predictive, 0.0, [0.22, 0.61, 11.0, 1.1]),
            run(Predictive, 1.0, [0.72, 4.7, 9.9, 3.7]),
        ],
    )
    .ends_free(),
    case(
        "drag 0.1 m/s",
        "hard/drag_100",
        "friction 0.3",
        &[
            run(Patch, 0.0, [19.0, 67.0, 15.0, 46.0]),
            run(LinearBoundary, 0.0, [14.0, 70.0, 14.0, 29.0]),
            run(Predictive, 0.0, [0.33, 4.9, 15.0, 0.55]),
            run(Predictive, 1.0, [0.9, 8.3, 15.0, 1.6]),
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
            run(Predictive, 0.0, [0.39, 3.3, 32.0, 0.68]),
            run(Predictive, 1.0, [2.1, 20.0, 31.0, 2.6]),
        ],
    )
    .ends_free(),
    case(
        "late hand",
        "hand",
        "results 1.5 and 2 periods late",
        &[
            run(Patch, 1.5, [52.0, 140.0, 8.2, 339.0]),
            run(Patch, 2.0, [64.0, 157.0, 9.7, 291.0]),
            run(LinearBoundary, 1.5, [43.0, 105.0, 7.6, 312.0]),
            run(LinearBoundary, 2.0, [52.0, 113.0, 9.1, 290.0]),
            run(Predictive, 1.5, [0.89, 3.4, 2.4, 3.3]),
            run(Predictive, 2.0, [1.8, 5.7, 2.4, 5.5]),
        ],
    ),
    case(
        "lost hand",
        "hand",
        "every second resync is lost",
        &[
            run(Patch, 1.0, [46.0, 102.0, 6.7, 280.0]),
            run(LinearBoundary, 1.0, [41.0, 104.0, 8.6, 292.0]),
            run(Predictive, 1.0, [1.2, 3.9, 2.5, 3.1]),
        ],
    )
    .upset(Upset::EverySecondLost),
    case(
        "stalled hand",
        "hard/hand_long",
        "the global model stands still for 1 s",
        &[
            run(Patch, 1.0, [37.0, 113.0, 7.3, 339.0]),
            run(LinearBoundary, 1.0, [32.0, 83.0, 7.2, 273.0]),
            run(Predictive, 1.0, [5.9, 17.0, 3.8, 1.7]),
        ],
    )
    .upset(Upset::Stall(0.5)),
];
