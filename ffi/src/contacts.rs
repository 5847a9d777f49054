//! Where the tools touch, from the records that the logger shares: 20 times a second, a tenth of a second late.

use palpate::log::{ContactPointSample, ContactSample, LogRecord};
use palpate::model::Vec3;
use palpate::model::contact::ContactMode;
use palpate::session::SharedRecords;

use crate::types::{PalpateContact, mode};

/// What is known of the contacts of a session.
pub(crate) struct Contacts {
    records: SharedRecords,
    /// By tool, in the newest tick that is known whole.
    tools: Vec<Touch>,
    /// Places of ticks whose head has not come.
    places: Vec<ContactPointSample>,
    /// By tool, the newest force on it (N).
    forces: Vec<[f64; 3]>,
}

/// How a tool touches in one tick.
#[derive(Clone, Default)]
struct Touch {
    head: ContactSample,
    /// Those of a tool with a shape.
    places: Vec<ContactPointSample>,
    force_n: [f64; 3],
}

impl Contacts {
    pub(crate) fn new(records: SharedRecords) -> Self {
        Self { records, tools: Vec::new(), places: Vec::new(), forces: Vec::new() }
    }

    /// Those of the newest tick; that of a point lies on its triangle of the surface of `triangles` and `positions` (m).
    pub(crate) fn newest(&mut self, triangles: &[[u32; 3]], positions: &[Vec3]) -> Vec<PalpateContact> {
        let Self { records, tools, places, forces } = self;
        // Of a tick come first the force, then the places, then the head.
        for record in records.newest() {
            match record {
                LogRecord::Force(sample) => {
                    // A model that has diverged is commanded as no force.
                    let is_finite = sample.force_n.iter().all(|part| part.is_finite());
                    *slot(forces, sample.device) = if is_finite { sample.force_n } else { [0.0; 3] };
                }
                LogRecord::ContactPoint(place) => places.push(place),
                LogRecord::Contact(head) => {
                    let force_n = *slot(forces, head.device);
                    let own: Vec<_> = places.extract_if(.., |place| place.device == head.device).collect();
                    let own = own.into_iter().filter(|place| place.time == head.time).collect();
                    *slot(tools, head.device) = Touch { head, places: own, force_n };
                }
                _ => {}
            }
        }
        tools.iter().flat_map(|touch| touch.contacts(triangles, positions)).collect()
    }
}

/// The value of a device, made if it is the first.
fn slot<T: Clone + Default>(values: &mut Vec<T>, device: u16) -> &mut T {
    let place = usize::from(device);
    values.resize(values.len().max(place + 1), T::default());
    &mut values[place]
}

impl Touch {
    fn contacts(&self, triangles: &[[u32; 3]], positions: &[Vec3]) -> Vec<PalpateContact> {
        let Self { head, places, force_n } = self;
        if !places.is_empty() {
            return places.iter().map(of_place).collect();
        }
        let corners = triangles.get(head.triangle as usize).filter(|_| head.mode != ContactMode::Free);
        let at = |node: u32| positions.get(node as usize).copied().unwrap_or_default();
        let of_point = |&[a, b, c]: &[u32; 3]| {
            let [second, third] = head.weights;
            let place = at(a) * (1.0 - second - third) + at(b) * second + at(c) * third;
            of_place(&ContactPointSample {
                time: head.time,
                place_m: place.map(|part| part as f32).into(),
                normal: head.normal,
                force_n: force_n.map(|part| part as f32),
                triangle: head.triangle,
                mode: head.mode,
                device: head.device,
            })
        };
        corners.map(of_point).into_iter().collect()
    }
}

fn of_place(place: &ContactPointSample) -> PalpateContact {
    PalpateContact {
        size: size_of::<PalpateContact>() as u32,
        mode: mode(place.mode) as u32,
        triangle: place.triangle,
        tool: place.device.into(),
        time_s: place.time.as_secs_f64(),
        place_m: place.place_m,
        normal: place.normal,
        force_n: place.force_n,
    }
}
