//! The tools on a patch: the one that it is for, and others that press the same part of the body.

use std::sync::Arc;

use super::super::ResyncView;
use super::feeling::Feeling;
use super::window::Window;
use crate::contact::{Contact, Friction, Rows, ToolMotion, Touch};
use crate::simulation::Stepping;
use crate::{Pose, Vec3};

/// The tools that are resolved together on a patch, and what those exert that are not.
#[derive(Clone, Debug, Default)]
pub(in crate::local) struct Tools {
    /// The number of each.
    numbers: Vec<usize>,
    touches: Vec<Touch>,
    feelings: Vec<Feeling>,
    /// So many touch here; others follow that have left.
    present: usize,
    rows: Rows,
    /// So many tools these have room for.
    room: usize,
    /// Movable nodes that tools press which are not held, with the force on each at the resync, which is taken to go on (N).
    beside: Vec<(usize, Vec3)>,
}

impl Tools {
    /// The touch of the tool of that number, if it is one of these.
    pub(in crate::local) fn touch(&self, number: usize) -> Option<&Touch> {
        self.place(number).map(|place| &self.touches[place])
    }

    /// What that tool feels.
    pub(super) fn feeling(&self, number: usize) -> Option<&Feeling> {
        self.place(number).map(|place| &self.feelings[place])
    }

    fn place(&self, number: usize) -> Option<usize> {
        self.numbers.iter().position(|&known| known == number)
    }

    /// True once none of them touches here.
    pub(super) fn are_gone(&self) -> bool {
        self.present == 0
    }

    /// Those that are resolved here, with the number of each.
    pub(super) fn present(&mut self) -> (&mut [Touch], &[usize], &mut Rows) {
        (&mut self.touches[..self.present], &self.numbers, &mut self.rows)
    }

    /// Takes the tools as they are at a resync: the patch's own, and all others whose places `window` holds, whose nodes at rest are at
    /// `rest` (m).
    pub(super) fn take_present(&mut self, resync: &ResyncView<'_>, window: &Window, rest: &[Vec3]) {
        let global = &*resync.global;
        self.beside.clear();
        self.numbers.clear();
        self.numbers.push(resync.index);
        let (mut pressed, masses) = (Vec::new(), global.body().inverse_masses());
        for other in (0..global.tools()).filter(|&other| other != resync.index) {
            let exerted = global.exerted(other);
            let is_held = |&node: &u32| window.movable(node).is_some() || masses[node as usize] == 0.0;
            let is_here = resync.nearest.get(other).is_some_and(|&triangle| {
                global.pressed_at(other, &[triangle], &mut pressed);
                window.triangle(triangle).is_some()
                    && pressed.iter().all(is_held)
                    && exerted.iter().all(|(node, _)| is_held(node))
            });
            if is_here {
                self.numbers.push(other);
            } else {
                self.stay_beside(&exerted, window);
            }
        }
        self.present = self.numbers.len();
        self.touches.resize_with(self.present, Touch::default);
        self.feelings.clear();
        if self.room < self.present {
            (self.rows, self.room) = (Rows::with_room(self.present), self.present);
        }
        for (mine, &number) in self.touches.iter_mut().zip(&self.numbers) {
            let touch = global.touch(number);
            if mine.shape != touch.shape {
                *mine = Touch::new(touch.shape, Arc::default(), Contact::default());
            }
            mine.restart(touch, |contact| window.localised(contact), |triangle| window.triangle(triangle));
            let skin = Arc::make_mut(&mut mine.skin);
            touch.skin.localise(&window.nodes, |node| window.node(node), skin);
            let pose = resync.tools[number].pose(0.0);
            self.feelings.push(Feeling::new(global.wrench(number), &pose, mine, (&window.surface, rest)));
        }
        if self.touches.len() > 1 || self.touches[0].has_shape() {
            let surface = (&window.surface, &*window.candidates);
            self.rows.make_room(window.nodes.len(), surface, &self.touches);
        }
    }

    fn stay_beside(&mut self, exerted: &[(u32, Vec3)], window: &Window) {
        self.beside.extend(exerted.iter().filter_map(|&(node, force)| Some((window.movable(node)?, force))));
    }

    /// Adds to the `forces` on the window's nodes (N) what tools exert that are not resolved here.
    pub(super) fn add_beside(&self, window: &Window, forces: &mut [Vec3]) {
        for &(place, force) in &self.beside {
            forces[place] += force;
        }
        let movable = &mut forces[..window.movable];
        for gone in &self.touches[self.present..] {
            gone.each_exerted(&window.surface, gone.wrench.force, |node, force| {
                if let Some(sum) = movable.get_mut(node as usize) {
                    *sum += force;
                }
            });
        }
    }

    /// A tick begins in which each tool goes the way of its number. One that was put elsewhere touches nothing until it meets something.
    pub(in crate::local) fn begin(&mut self, ways: &[ToolMotion]) {
        for (place, (feeling, &number)) in self.feelings.iter_mut().zip(&self.numbers).enumerate() {
            let is_put = feeling.begin(ways[number].from.position);
            if let Some(touch) = self.touches[..self.present].get_mut(place) {
                touch.begin();
                if is_put {
                    touch.lift();
                }
            }
        }
    }

    /// A step is over, or a part of it of that `length`. Those that press on nodes that give way in the body, but not here, go on as they
    /// pressed last.
    pub(super) fn end_step(&mut self, length: f64, window: &Window, rest: &[Vec3]) {
        self.feelings
            .iter_mut()
            .zip(&self.touches[..self.present])
            .for_each(|(feeling, touch)| feeling.add(touch.wrench * length));
        while let Some(gone) = (0..self.present).find(|&tool| window.has_left(&self.touches[tool])) {
            self.feelings[gone].stray(&self.touches[gone], (&window.surface, rest));
            self.present -= 1;
            self.touches.swap(gone, self.present);
            self.numbers.swap(gone, self.present);
            self.feelings.swap(gone, self.present);
            self.rows.swap(gone, self.present);
        }
    }

    /// A tick of such steps is over, at whose end the tool of each number is at a pose of `end`.
    pub(super) fn end_tick(
        &mut self,
        end: impl Fn(usize) -> Pose,
        stepping: Stepping,
        (window, rest): (&Window, &[Vec3]),
        friction: &Friction,
    ) {
        let id = |triangle: u32| window.triangles[triangle as usize];
        for ((touch, feeling), &number) in self.touches.iter_mut().zip(&mut self.feelings).zip(&self.numbers) {
            let pose = end(number);
            if feeling.is_beyond() {
                feeling.follow(&pose, touch, friction);
            } else {
                touch.end(stepping.tick, id);
                feeling.end(&pose, stepping.substeps, touch, (&window.surface, rest));
            }
        }
    }

    /// From now on nobody feels anything that is finite.
    pub(super) fn spoil(&mut self) {
        self.feelings.iter_mut().for_each(Feeling::spoil);
    }
}
