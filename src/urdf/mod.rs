//! Import of arms from URDF and export of identified origins to the same file.
//!
//! A URDF joint is a fixed transform, its origin, followed by a motion about or along any axis. The
//! transform between two axes is converted to the five joint parameters α, a, θ, d, β of flexcal,
//! which is always possible except at the ends of the chain. The frames of a URDF and of its
//! problem therefore differ by a rotation about and a shift along each joint's axis, called the
//! gauge of that axis.

mod branch;
mod carried;
mod chain;
mod describe;
mod export;
mod fork;
mod free;
mod lines;
mod mounted;
mod not_closed;
mod notes;
mod number;
mod patches;
mod read;
mod row;
mod sheet;
mod sheet_table;
mod yaml;

pub(crate) use branch::Steps;
pub use chain::Chain;
pub(crate) use chain::{in_tree_order, names_of_joints};
pub(crate) use describe::SIGMA_MM;
pub use describe::{Description, describe};
pub use export::{Export, export};
pub(crate) use patches::MovedOrigin;
pub use read::Robot;
pub(crate) use sheet::complete;
pub(crate) use sheet_table::text_of_table;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    describe::{HELD_OUT, TAG, describe_measured},
    export::export_with_links,
    mounted::{MountedLink, mounted_links, mounted_target},
    yaml::{YamlFormat, joint_origins, yaml},
};
pub(crate) use yaml::key as yaml_key;
