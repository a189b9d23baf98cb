//! How joints stand on each other.

use super::Joint;
use super::item::Item;
use crate::error::{InputError, InputErrorKind};

/// Which joints stand on which, directly or through others; by default each on the one before it.
///
/// Joints are listed branch by branch: everything that stands on a joint comes right behind it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tree {
    /// For each joint the index behind the last one that stands on it; empty for a chain.
    ends: Vec<usize>,
    /// Further branches that begin at the base and behind each joint, besides the first; empty for
    /// a chain.
    further: Vec<usize>,
}

impl Tree {
    /// Of joints that each name the one they stand on.
    pub fn of(joints: &[Joint]) -> Self {
        let is_chain =
            joints.iter().enumerate().all(|(index, own)| own.parent == index.checked_sub(1));
        if is_chain {
            return Self::default();
        }
        let mut stands = Self { ends: (1..=joints.len()).collect(), further: Vec::new() };
        // Everything that stands on a joint is behind it, the last of it in the last branch.
        for (index, own) in joints.iter().enumerate().rev() {
            let end = stands.ends.get(index).copied().unwrap_or(index + 1);
            if let Some(of_parent) = own.parent.and_then(|parent| stands.ends.get_mut(parent)) {
                *of_parent = end.max(*of_parent);
            }
        }
        let on = |carrier: Option<usize>| {
            joints.iter().filter(|own| own.parent == carrier).count().saturating_sub(1)
        };
        stands.further = std::iter::once(None).chain((0..joints.len()).map(Some)).map(on).collect();
        stands
    }

    /// Whether each joint stands on the one before it.
    pub fn is_chain(&self) -> bool {
        self.ends.is_empty()
    }

    /// Whether the way from the base to the frame of the joint `tip` leads through a joint, `tip`
    /// itself included.
    #[inline]
    pub fn leads_through(&self, joint: usize, tip: usize) -> bool {
        joint <= tip && self.ends.get(joint).is_none_or(|&end| tip < end)
    }

    /// Whether a joint begins a branch that stands on an earlier joint than the one before it, or
    /// on the base.
    #[inline]
    pub fn begins_branch(&self, joint: usize) -> bool {
        joint.checked_sub(1).and_then(|before| self.ends.get(before)) == Some(&joint)
    }

    /// How many branches besides the first stand on the base.
    pub fn further_on_base(&self) -> usize {
        self.further.first().copied().unwrap_or(0)
    }

    /// How many branches besides the first stand on a joint.
    #[inline]
    pub fn further_on(&self, joint: usize) -> usize {
        self.further.get(joint + 1).copied().unwrap_or(0)
    }
}

/// On which joint each joint stands, from the values of its `parent`, a number counted from 1 or 0
/// for the base; without one on the joint before.
pub(super) fn parents(given: &[Option<Item<'_, '_>>]) -> Result<Vec<Option<usize>>, InputError> {
    let mut parents = Vec::with_capacity(given.len());
    // From the base to the joint before: what the next one may stand on.
    let mut open: Vec<usize> = Vec::new();
    for (joint, item) in given.iter().enumerate() {
        let parent = match item {
            None => joint.checked_sub(1),
            Some(item) => {
                let number = item.whole(0)?;
                let parent = usize::try_from(number).unwrap_or(usize::MAX).checked_sub(1);
                match parent {
                    Some(parent) if parent >= given.len() => {
                        return Err(item.error(InputErrorKind::UnknownJoint {
                            joint: number,
                            joints: given.len(),
                        }));
                    }
                    Some(parent) if parent >= joint => {
                        return Err(item.error(InputErrorKind::StandsOnLater {
                            joint: joint + 1,
                            parent: number,
                        }));
                    }
                    Some(parent) if !open.contains(&parent) => {
                        return Err(item.error(InputErrorKind::BranchEnded { parent: number }));
                    }
                    parent => parent,
                }
            }
        };
        while open.last().is_some_and(|&last| Some(last) != parent) {
            open.pop();
        }
        open.push(joint);
        parents.push(parent);
    }
    Ok(parents)
}
