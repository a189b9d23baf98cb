//! Parent relations of the joints of an arm.

use super::Joint;
use super::item::Item;
use crate::error::{InputError, InputErrorKind};

/// Parent relations of the joints; by default each joint is the child of the joint before it.
///
/// Joints are listed branch by branch: all descendants of a joint follow it directly.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tree {
    /// For each joint, the index after its last descendant; empty for a chain.
    ends: Vec<usize>,
    /// For the base and then each joint, the number of children beyond the first; empty for a
    /// chain.
    extra_children: Vec<usize>,
}

impl Tree {
    /// Creates the tree from the parents that the joints declare.
    pub fn from_joints(joints: &[Joint]) -> Self {
        let is_chain =
            joints.iter().enumerate().all(|(index, joint)| joint.parent == index.checked_sub(1));
        if is_chain {
            return Self::default();
        }
        let mut tree = Self { ends: (1..=joints.len()).collect(), extra_children: Vec::new() };
        // The descendants of a joint follow it, so its last branch ends last.
        for (index, joint) in joints.iter().enumerate().rev() {
            let end = tree.ends.get(index).copied().unwrap_or(index + 1);
            if let Some(parent_end) = joint.parent.and_then(|parent| tree.ends.get_mut(parent)) {
                *parent_end = end.max(*parent_end);
            }
        }
        let extra = |parent: Option<usize>| {
            joints.iter().filter(|joint| joint.parent == parent).count().saturating_sub(1)
        };
        tree.extra_children =
            std::iter::once(None).chain((0..joints.len()).map(Some)).map(extra).collect();
        tree
    }

    /// Returns true if the parent of each joint is the joint before it.
    pub fn is_chain(&self) -> bool {
        self.ends.is_empty()
    }

    /// Returns true if `joint` lies on the path from the base to the frame of joint `tip`, `tip`
    /// included.
    #[inline]
    pub fn path_contains(&self, joint: usize, tip: usize) -> bool {
        joint <= tip && self.ends.get(joint).is_none_or(|&end| tip < end)
    }

    /// Returns true if a joint begins a branch: its parent is not the joint before it.
    #[inline]
    pub fn begins_branch(&self, joint: usize) -> bool {
        joint.checked_sub(1).and_then(|before| self.ends.get(before)) == Some(&joint)
    }

    /// Returns the number of branches from the base after the first.
    pub fn extra_branches_at_base(&self) -> usize {
        self.extra_children.first().copied().unwrap_or(0)
    }

    /// Returns the number of branches from a joint after the first.
    #[inline]
    pub fn extra_branches_on(&self, joint: usize) -> usize {
        self.extra_children.get(joint + 1).copied().unwrap_or(0)
    }
}

/// Returns the parent of each joint from the values of the key `parent` (counted from 1, 0 for the
/// base). The default is the joint before. A parent that is listed later, or whose branch has
/// ended, is an error.
pub(super) fn read_parents(
    given: &[Option<Item<'_, '_>>],
) -> Result<Vec<Option<usize>>, InputError> {
    let mut parents = Vec::with_capacity(given.len());
    // Joints on the path from the base to the previous joint, which are the allowed parents of the
    // next.
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
                        return Err(item.error(InputErrorKind::ParentListedLater {
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
