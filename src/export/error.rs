//! Errors of exports of an identified arm.

use crate::error::InputError;
use crate::fit::{IdentifyError, PredictError, SavedEstimateError, StageError};
use crate::measurement::DatasetError;

/// Error of an identified arm that cannot be exported in the chosen form.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The orientation of the tool, whose pose is to be written to a link, is not known.
    #[error(
        "--tool-link writes a pose, and the orientation of the tool was neither fitted \
         (orientation_sigma_deg in [data]) nor declared (rotation_deg in [tool])"
    )]
    ToolNotTurned,
    /// There is no tool, but a camera whose mount is written without the option.
    #[error(
        "--tool-link writes the pose of a tool, and what is measured here is camera {camera}, whose \
         mount the file has without it: leave --tool-link out"
    )]
    CameraIsWritten {
        /// Name of the camera.
        camera: String,
    },
    /// Sessions or targets have different tools.
    #[error(
        "--tool-link writes one pose, and the sessions or targets of the estimate have different ones"
    )]
    SeveralTools,
    /// The measurements do not determine the pose of a camera or a marker.
    #[error(
        "the measurements do not determine {coordinates} of {fixture}, so that its pose in \
         the file would be arbitrary; declare the place of the camera or of the marker (at_m, \
         rotation_deg) or hold the coordinates of the tool, or add views with the hand turned about \
         two axes"
    )]
    PoseOpen {
        /// Kind and name of the camera or marker.
        fixture: String,
        /// Names of the coordinates.
        coordinates: String,
    },
    /// Cameras or markers are mounted on a tree, of which only the frame of the target would be
    /// approximated.
    #[error(
        "--best-rigid approximates the target alone, and this problem has cameras or markers on \
         several branches; export without it"
    )]
    MountedOnTree,
    /// A law depends on earlier poses.
    #[error(
        "{formula} depends on earlier poses, which the generated code does not keep; identify \
         the problem without this effect and export that"
    )]
    NeedsPast {
        /// Formula of the law.
        formula: String,
    },
    /// The formula of a law contains moments of the loads.
    #[error(
        "{formula} follows moments of the loads, which the generated code does not sum; identify \
         the problem without this effect and export that"
    )]
    NeedsLoads {
        /// Formula of the law.
        formula: String,
    },
    /// A number is too large for a constant.
    #[error("{what} is {value}, which C cannot hold")]
    NotFinite {
        /// Description of the number, for the message.
        what: String,
        /// Number in SI units that a C `double` literal cannot hold.
        value: f64,
    },
    /// Too few of the poses drawn are inside the workspace.
    #[error(
        "{found} of {draws} poses within the joint limits are inside of the workspace; widen it, or \
         multiply the numbers of --workspace-mm by 1000 if they are metres"
    )]
    Unreachable {
        /// Number of poses inside the workspace.
        found: usize,
        /// Number of poses drawn.
        draws: usize,
    },
    /// An option has no effect on the chosen form.
    #[error("{option} has no effect on this --format; leave it out")]
    WithoutEffect {
        /// Option of the command line.
        option: &'static str,
    },
    /// Two options choose different geometries.
    #[error("--best-rigid and --fitted-alone write different geometries; give one of them")]
    TwoGeometries,
    /// The problem declares no such camera.
    #[error(
        "{}",
        if known.is_empty() {
            "the problem declares no [[camera]], which this format needs".to_owned()
        } else {
            format!("no such camera; there are {}", known.join(", "))
        }
    )]
    NoCamera {
        /// Names of the declared cameras.
        known: Vec<String>,
    },
    /// The form holds one camera, and the problem declares several.
    #[error("choose a camera with --camera: {}", known.join(", "))]
    SeveralCameras {
        /// Names of the declared cameras.
        known: Vec<String>,
    },
    /// Kalibr's lens model lacks a coefficient of the camera.
    #[error(
        "Kalibr's radtan model has no k3; identify with \"camera[{camera}].k3\" = {{ fixed = true }} \
         and k3 = 0 in distortion, and export that"
    )]
    ThirdRadial {
        /// Name of the camera.
        camera: String,
    },
    /// The fit of a rigid model without effects needs measurements.
    #[error("--fitted-alone fits the measurements: name them with --data")]
    NeedsData,
    /// The rigid model cannot be fitted.
    #[error("the geometry alone: {0}")]
    Alone(#[from] IdentifyError),
    /// Problem and poses do not match.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Poses of the test cannot be predicted.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// Poses of the test do not form a valid data set.
    #[error(transparent)]
    Poses(#[from] DatasetError),
    /// The estimate belongs to another problem.
    #[error(transparent)]
    Estimate(#[from] SavedEstimateError),
    /// Commands of the test cannot be computed.
    #[error(transparent)]
    Compensate(#[from] StageError),
}
