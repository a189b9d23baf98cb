//! Life of an arm: an earlier estimate as the prior of a new one, and tests for a change since
//! then.
//!
//! [`update()`] fits new rows with the posterior of an earlier estimate as prior, and carries its
//! remainder over. Rows of the earlier fit are not used again. The prior is widened by drift, and in
//! parameters in which the new rows contradict it. [`watch()`] tests new rows one after the other
//! for a change since the estimate. [`fleet()`] finds mean and spread of the parameters of several
//! arms of one type, which serve as the prior of the next one.

mod assessment;
mod causes;
mod column_space;
mod contradiction;
mod drift;
mod earlier;
mod error;
mod evidence;
mod fleet;
mod fleet_file;
mod held;
mod identify;
mod known_noise;
mod onset;
mod pairs;
mod relocation;
mod reporter;
mod rows;
mod update;
mod watch;

#[doc(hidden)]
pub use causes::CauseKind;
#[doc(hidden)]
pub use error::PriorError;
#[doc(hidden)]
pub use fleet::{Fleet, FleetArm, FleetParameter, fleet};
#[doc(hidden)]
pub use fleet_file::FleetPrior;
#[doc(hidden)]
pub use identify::PriorSource;
#[doc(hidden)]
pub use reporter::{Change, WatchedCause};
#[doc(hidden)]
pub use update::{Update, update};
#[doc(hidden)]
pub use watch::{Watch, watch};

pub(crate) use watch::MIN_EXPECTED_P;
