//! Many short lists in one piece of memory.

/// For each of a number of owners, such as nodes, a list of what belongs to it, such as triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Lists {
    /// Where each owner's list begins in `items`; one entry more than owners.
    first: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// The lists of `owners` owners from pairs of an owner and an item; each keeps the order of the pairs.
    pub(crate) fn new(owners: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut new = Self::default();
        new.fill(owners, pairs);
        new
    }

    /// Makes the lists anew, in their old memory if that is enough.
    pub(crate) fn fill(&mut self, owners: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) {
        let Self { first, items } = self;
        first.clear();
        // Counted one place late, so that filling the lists moves each beginning to where it belongs.
        first.resize(owners + 2, 0);
        pairs.clone().for_each(|(owner, _)| first[owner as usize + 2] += 1);
        (1..=owners).for_each(|owner| first[owner + 1] += first[owner]);
        items.clear();
        items.resize(first[owners + 1] as usize, 0);
        for (owner, item) in pairs {
            let next = &mut first[owner as usize + 1];
            items[*next as usize] = item;
            *next += 1;
        }
        first.pop();
    }

    /// The number of owners.
    pub(crate) fn owners(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    /// The list of an owner.
    pub(crate) fn of(&self, owner: u32) -> &[u32] {
        &self.items[self.first[owner as usize] as usize..self.first[owner as usize + 1] as usize]
    }
}
