//! Empty local models of whichever kind is wanted.

use crate::model::body::Body;
use crate::model::local::{Kind, LocalModel, LocalModels, Template};

/// Makes the local models of a session, whose kind may change while it runs.
#[derive(Clone, Debug)]
pub struct ModelMaker {
    /// Those that have been needed; the first is that of the start.
    templates: Vec<Template>,
    /// The kinds that there may be, with the patch of each: nodes along the surface, along it, into depth.
    patches: Vec<(Kind, [usize; 3])>,
    /// Logged nodes.
    probes: Vec<u32>,
}

impl ModelMaker {
    /// Of models as `first` says, and of the kinds in `patches`; they watch the nodes `probes`.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(first: Template, patches: Vec<(Kind, [usize; 3])>, probes: Vec<u32>) -> Self {
        Self { templates: vec![first], patches, probes }
    }

    /// Empty models for so many `tools`, as at the start.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn first(&self, tools: usize) -> LocalModels {
        LocalModels::new(tools, || self.watching(&self.templates[0]))
    }

    /// Empty models as at the start, for the side of the global one where the local ones are built elsewhere.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn departing(&self, tools: usize) -> LocalModels {
        LocalModels::new(tools, || self.watch(self.templates[0].departing()))
    }

    fn watching(&self, template: &Template) -> Box<dyn LocalModel> {
        self.watch(template.empty())
    }

    fn watch(&self, mut model: Box<dyn LocalModel>) -> Box<dyn LocalModel> {
        model.watch(&self.probes);
        model
    }

    /// Puts models of `kind` for `body`, as it was made, in place of those of another kind. A kind that there may not be changes
    /// nothing: only a damaged log asks for one.
    ///
    /// # Real-time
    /// For the global actor: may allocate, and takes its time when a kind is needed for the first time.
    pub fn put(&mut self, kind: Kind, body: &dyn Body, models: &mut LocalModels) {
        if models.kind() == kind {
            return;
        }
        if !self.templates.iter().any(|template| template.kind == kind) {
            let patch = self.patches.iter().find(|(of, _)| *of == kind).map(|(_, patch)| *patch);
            let made = patch.and_then(|patch| self.templates[0].of_kind(kind, patch, body).ok());
            self.templates.extend(made);
        }
        if let Some(template) = self.templates.iter().find(|template| template.kind == kind) {
            *models = LocalModels::new(models.hosts().len(), || self.watching(template));
        }
    }
}
