//! Region in which the target must stay, as arguments.

use clap::Args;
use flexcal::design::Workspace;
use flexcal::nalgebra::Vector3;

/// Box and half-spaces of the nominal target.
#[derive(Debug, Args)]
pub struct Region {
    /// Box that the nominal target stays in, frame of the arm's base
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = numbers::<6>, allow_hyphen_values = true)]
    workspace_mm: Option<[f64; 6]>,
    /// Plane that the nominal target stays beyond, frame of the arm's base: N·p ≥ D for a normal N
    #[arg(long, value_name = "NX,NY,NZ,D", value_parser = numbers::<4>, allow_hyphen_values = true)]
    keep_out_mm: Vec<[f64; 4]>,
}

/// Error of region arguments that are invalid.
#[derive(Debug, thiserror::Error)]
pub enum RegionError {
    #[error(
        "--workspace-mm: the box is empty; write X0,X1,Y0,Y1,Z0,Z1, the lesser of each pair first"
    )]
    Empty,
    #[error("--keep-out-mm: 0,0,0 is no normal of a plane")]
    NoNormal,
}

impl Region {
    /// Returns the workspace of the arguments, if they restrict it.
    pub fn workspace(&self) -> Result<Option<Workspace>, RegionError> {
        let room = match self.workspace_mm.map(|room| room.map(|x| x * 1e-3)) {
            Some([x0, x1, y0, y1, z0, z1]) if x0 < x1 && y0 < y1 && z0 < z1 => {
                Some([Vector3::new(x0, y0, z0), Vector3::new(x1, y1, z1)])
            }
            Some(_) => return Err(RegionError::Empty),
            None => None,
        };
        let plane = |[x, y, z, least]: [f64; 4]| {
            let normal = Vector3::new(x, y, z).try_normalize(0.0).ok_or(RegionError::NoNormal)?;
            Ok((normal, least * 1e-3))
        };
        let planes = self.keep_out_mm.iter().copied().map(plane).collect::<Result<Vec<_>, _>>()?;
        let is_restricted = room.is_some() || !planes.is_empty();
        Ok(is_restricted.then_some(Workspace { corners: room, planes }))
    }
}

/// Parses `N` finite numbers with commas between them.
pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers = text
        .split(',')
        .map(|word| word.trim().parse().ok().filter(|number: &f64| number.is_finite()));
    let numbers: Option<Vec<f64>> = numbers.collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| format!("not {N} numbers with commas between them"))
}
