//! Misreadings of two entries of the joint table at once.

use super::Misreading;
use crate::model::parameter::JointField;
use crate::problem::Problem;

/// Returns the misreadings of two entries of which each alone is `tested`: two angles α of the other
/// sign and, unless another misreading is near, two zero positions that are off by quarter turns.
pub(super) fn of_two_entries(tested: &[Misreading], is_near: bool) -> Vec<Misreading> {
    let signs = tested.iter().filter_map(|misreading| match *misreading {
        Misreading::Sign { joint, field: JointField::Alpha } if joint > 0 => Some(joint),
        _ => None,
    });
    let zeros = tested.iter().filter_map(|misreading| match *misreading {
        Misreading::Zero { joint, degrees: 90 } => Some(joint),
        _ => None,
    });
    let of_pair = |joints| {
        let pairs = [1, 2, -1].map(|first| [1, 2, -1].map(|second| [first, second])).concat();
        pairs.into_iter().map(move |quarters| Misreading::Zeros { joints, quarters })
    };
    let zeros = if is_near { Vec::new() } else { pairs(&zeros.collect::<Vec<_>>()) };
    let signs = pairs(&signs.collect::<Vec<_>>())
        .into_iter()
        .map(|joints| Misreading::TwistSigns { joints });
    signs.chain(zeros.into_iter().flat_map(of_pair)).collect()
}

/// Returns all pairs of some joints.
fn pairs(joints: &[usize]) -> Vec<[usize; 2]> {
    let later = |(k, &one): (usize, &usize)| {
        joints[k + 1..].iter().map(move |&other| [one, other]).collect::<Vec<_>>()
    };
    joints.iter().enumerate().flat_map(later).collect()
}

impl Misreading {
    /// Describes a misreading of two entries; empty for others.
    pub(super) fn words_of_two(self) -> String {
        match self {
            Self::Zeros { joints: [one, other], quarters: [first, second] } => {
                let [first, second] = [first, second].map(|quarters| 90 * i16::from(quarters));
                format!(
                    "joints {one} and {other} whose zero positions are {first}° and {second}° off"
                )
            }
            Self::TwistSigns { joints: [one, other] } => {
                format!("alpha of joints {one} and {other} that have the other sign")
            }
            _ => String::new(),
        }
    }

    /// Returns the rows of a joint table in standard DH form of two angles α, which are those before
    /// their joints; `None` for other misreadings and tables.
    pub(super) fn places_of_two(self, problem: &Problem) -> Option<String> {
        let Self::TwistSigns { joints: [one, other] } = self else { return None };
        problem.standard_rows().map(|_| format!("rows {} and {} of the table", one - 1, other - 1))
    }
}

/// Returns the name of an entry of the joint table, such as `alpha of joint 3`; `joint` is 0 for
/// all joints.
pub(super) fn entry_name(joint: usize, field: JointField) -> String {
    let name = match field {
        JointField::A => "the length a",
        JointField::D => "the offset d",
        _ => field.name(),
    };
    match joint {
        0 => format!("{name} of all joints"),
        _ => format!("{name} of joint {joint}"),
    }
}
