//! The tools on a patch: the one that it is for, and others that press the same part of the body.

use std::sync::Arc;

use super::super::ResyncView;
use super::window::Window;
use crate::Vec3;
use crate::contact::{Contact, Rows, Touch};

/// The tools that are resolved together on a patch, and what those exert that are not.
#[derive(Clone, Debug, Default)]
pub(in crate::local) struct Tools {
    /// The number of each, that of the tool that the patch is for first.
    numbers: Vec<usize>,
    touches: Vec<Touch>,
    /// So many touch here; others follow that have left.
    present: usize,
    pub(super) rows: Rows,
    /// So many tools these have room for.
    room: usize,
    /// Movable nodes that tools press which are not held, with the force on each at the resync, which is taken to go on (N).
    beside: Vec<(usize, Vec3)>,
}

impl Tools {
    /// The tool that the patch is for.
    pub(in crate::local) fn own(&self) -> &Touch {
        &self.touches[0]
    }

    /// The number of that one.
    pub(in crate::local) fn number(&self) -> usize {
        self.numbers[0]
    }

    /// Those that are resolved here, with the number of each.
    pub(super) fn present(&mut self) -> (&mut [Touch], &[usize], &mut Rows) {
        (&mut self.touches[..self.present], &self.numbers, &mut self.rows)
    }

    /// Takes the tools as they are at a resync: the patch's own, and all others whose places `window` holds.
    pub(super) fn take_present(&mut self, resync: &ResyncView<'_>, window: &Window) {
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
        }
        if self.present > 1 || self.own().has_shape() {
            self.rows.make_room(window.nodes.len(), window.candidates.len());
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

    /// A tick begins.
    pub(in crate::local) fn begin(&mut self) {
        self.touches[..self.present].iter_mut().for_each(Touch::begin);
    }

    /// A tick of `steps` steps is over.
    pub(super) fn end(&mut self, steps: u32, window: &Window) {
        let id = |triangle: u32| window.triangles[triangle as usize];
        self.touches[..self.present].iter_mut().for_each(|touch| touch.end(steps, id));
    }

    /// After a step: those that press on nodes that give way in the body, but not here, go on as they pressed last. The patch's own
    /// stays.
    pub(super) fn let_go(&mut self, window: &Window) {
        while let Some(gone) = (1..self.present).find(|&tool| window.has_left(&self.touches[tool])) {
            self.present -= 1;
            self.touches.swap(gone, self.present);
            self.numbers.swap(gone, self.present);
            self.rows.forget();
        }
    }
}
