//! Two arms on a torso: equilibrium from transforms and moments computed here.

use flexcal::fit::Placement;
use flexcal::least_squares::jacobian;
use flexcal::measurement::Measurements;
use flexcal::model::PoseResiduals;
use flexcal::problem::{Equilibrium, Joint, JointKind, Problem};
use nalgebra::{DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::common::arms::{golden, parse, path};
use crate::common::made::{at_random, model_of, of_targets, predicted};

fn turn(axis: Vector3<f64>, angle: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(axis * angle))
}

fn shift(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Translation3::new(x, y, z).into()
}

/// Returns the frame of a joint before its rotation, and behind it, with its coordinate and a
/// twist.
fn step(joint: &Joint, q: f64, twist: f64) -> (Isometry3<f64>, Isometry3<f64>) {
    let [x, y, z] =
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| move |angle: f64| turn(axis, angle));
    let placed = joint.placement.map_or(Isometry3::identity(), |frame| {
        shift(frame.xyz.x, frame.xyz.y, frame.xyz.z)
            * z(frame.rpy.z)
            * y(frame.rpy.y)
            * x(frame.rpy.x)
    });
    let (q, way) = match joint.kind {
        JointKind::Revolute => (q, 0.0),
        JointKind::Prismatic => (0.0, q),
        JointKind::Fixed => (0.0, 0.0),
    };
    let before = placed * x(joint.alpha) * shift(joint.a, 0.0, 0.0);
    (before, z(joint.theta + q + twist) * shift(0.0, 0.0, joint.d + way) * y(joint.beta))
}

/// Returns the frame of every joint in the base frame after some passes; each joint rotates by the
/// moment about its axis of everything it carries, over its stiffness.
fn at_rest(problem: &Problem, q: &[f64], payload: f64, passes: usize) -> Vec<Isometry3<f64>> {
    let joints = &problem.joints;
    let stands_on = |mut joint: usize, other: usize| loop {
        match joints[joint].parent {
            _ if joint == other => return true,
            Some(parent) => joint = parent,
            None => return false,
        }
    };
    let mut twists = vec![0.0; joints.len()];
    let (mut axes, mut frames): (Vec<Isometry3<f64>>, Vec<Isometry3<f64>>) =
        (Vec::new(), Vec::new());
    for _ in 0..=passes {
        (axes, frames) = (Vec::new(), Vec::new());
        for (k, joint) in joints.iter().enumerate() {
            let on = joint.parent.map_or(Isometry3::identity(), |parent| frames[parent]);
            let (before, behind) = step(joint, q[k], twists[k]);
            axes.push(on * before);
            frames.push(on * before * behind);
        }
        let place = |carrier: usize, at: Vector3<f64>| (frames[carrier] * Point3::from(at)).coords;
        let mut masses: Vec<(usize, Vector3<f64>, f64)> = Vec::new();
        for (k, joint) in joints.iter().enumerate() {
            masses.extend(joint.bodies.iter().map(|body| (k, place(k, body.position), body.mass)));
        }
        let tool = &problem.tool;
        masses.push((tool.joint, place(tool.joint, tool.payload_at), payload));
        for (k, joint) in joints.iter().enumerate() {
            let (at, axis) = (axes[k].translation.vector, axes[k] * Vector3::z());
            let carried = masses.iter().filter(|(carrier, ..)| stands_on(*carrier, k));
            let moment: f64 = carried
                .map(|(_, place, mass)| axis.dot(&(place - at).cross(&(problem.gravity * *mass))))
                .sum();
            twists[k] = joint.stiffness.map_or(0.0, |stiffness| moment / stiffness);
        }
    }
    assert_eq!(axes.len(), joints.len());
    frames
}

fn two_arms() -> Problem {
    Problem::read(&path("problems/two-arms")).unwrap()
}

/// Returns the same configurations for both hands in turn, with a payload in the right one.
fn rows(problem: &Problem, payload: f64) -> Measurements {
    let mut rows = at_random(problem, 20, 1.0, &mut ChaCha8Rng::seed_from_u64(1));
    rows = rows.select(&(0..40).map(|row| row / 2).collect::<Vec<_>>());
    rows.payload = Some(vec![payload; rows.len()]);
    of_targets(problem, rows)
}

/// Returns the positions computed here.
fn by_hand(problem: &Problem, rows: &Measurements, passes: usize) -> Vec<Vector3<f64>> {
    let position = |row: usize| {
        let target = &problem.targets[row % 2];
        let payload = rows.payload.as_ref().unwrap()[row];
        let frames = at_rest(problem, rows.configuration(row), payload, passes);
        (frames[target.joint] * Point3::from(target.at)).coords
    };
    (0..rows.len()).map(position).collect()
}

fn by_model(problem: &Problem, rows: &Measurements) -> Vec<Vector3<f64>> {
    predicted(problem, rows, &DVector::zeros(model_of(problem, rows).parameters.len()))
}

fn farthest(one: &[Vector3<f64>], other: &[Vector3<f64>]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn both_hands_rest_where_the_moments_of_both_arms_put_them() {
    let mut problem = two_arms();
    for (equilibrium, passes) in [(Equilibrium::Deflected, 200), (Equilibrium::Undeflected, 1)] {
        problem.statics.equilibrium = equilibrium;
        let (light, heavy) = (rows(&problem, 0.0), rows(&problem, 2.5));
        let (ours, theirs) = (by_model(&problem, &heavy), by_hand(&problem, &heavy, passes));
        let sag = farthest(&theirs, &by_hand(&problem, &heavy, 0));
        let off = farthest(&ours, &theirs);
        // Displacement of the left hand by the load of the right one.
        let (ours_light, theirs_light) =
            (by_model(&problem, &light), by_hand(&problem, &light, passes));
        let (mut worst, mut least, mut most) = (0.0_f64, f64::INFINITY, 0.0_f64);
        for row in (0..ours.len()).filter(|row| row % 2 == 0) {
            let (moved, expected) = (ours[row] - ours_light[row], theirs[row] - theirs_light[row]);
            (least, most) = (least.min(expected.norm()), most.max(expected.norm()));
            worst = worst.max((moved - expected).norm() / expected.norm());
        }
        println!(
            "{equilibrium:?}: sag {:.1} mm, off by {off:.1e} m; the right load moves the left hand by {:.3} to {:.3} mm, to {worst:.1e}",
            sag * 1e3,
            least * 1e3,
            most * 1e3
        );
        assert!(off < 1e-12, "{off:e} m of {sag} m");
        assert!(worst < 1e-6 && least > 1e-6 && most > 1e-3 && sag > 1e-2);
    }
}

/// A chain with explicit parents, and one with an additional empty branch, equal the chain to the
/// bit.
#[test]
fn a_chain_by_parents_is_the_chain() {
    let text = std::fs::read_to_string(golden("problem.toml")).unwrap();
    let mut parent = 0;
    let named: Vec<String> = text
        .lines()
        .map(|line| {
            if line.starts_with("[[joint]]") {
                parent += 1;
                format!("{line}\nparent = {}", parent - 1)
            } else {
                line.to_owned()
            }
        })
        .collect();
    let free = |text: &str| {
        let (before, after) = text.split_once("[parameters]\n").unwrap();
        let (_, after) = after.split_once("\n[data]\n").unwrap();
        parse(&format!("{before}[parameters]\n\"*\" = {{ free = true }}\n[data]\n{after}"))
    };
    let (chain, named) = (free(&text), free(&named.join("\n")));
    assert_eq!((chain.digest(), named.is_chain()), (named.digest(), true));
    let mut branched = chain.clone();
    let bare = parse("name = 'bare'\n[[joint]]\nkind = 'fixed'\n").joints.remove(0);
    branched.joints.push(Joint { parent: Some(1), ..bare.clone() });
    branched.joints.push(Joint { parent: None, ..bare });
    assert!(!branched.is_chain() && branched.tool.joint == 3);
    let of_chain = at_random(&chain, 12, 1.5, &mut ChaCha8Rng::seed_from_u64(3));
    let mut of_branched = of_chain.clone();
    of_branched.joints = 6;
    of_branched.configurations =
        of_chain.configurations.chunks(4).flat_map(|q| [q, &[0.3, -0.4]].concat()).collect();
    let columns = |problem: &Problem, rows: &Measurements| {
        let model = model_of(problem, rows);
        let indices: Vec<usize> = (0..model.parameters.len())
            .filter(|&k| {
                let name = &model.parameters[k].name;
                !name.starts_with("joint5") && !name.starts_with("joint6")
            })
            .collect();
        let poses = Placement::of(rows).poses(rows, &(0..rows.len()).collect::<Vec<_>>(), 1e-3);
        let residuals = PoseResiduals::new(
            &model,
            poses,
            indices.clone(),
            DVector::zeros(model.parameters.len()),
        );
        jacobian(&residuals, &DVector::zeros(indices.len()))
    };
    for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
        let with = |problem: &Problem| {
            let mut problem = problem.clone();
            problem.statics.equilibrium = equilibrium;
            problem
        };
        let (chain, named, branched) = (with(&chain), with(&named), with(&branched));
        let expected = by_model(&chain, &of_chain);
        assert_eq!(by_model(&named, &of_chain), expected);
        assert_eq!(by_model(&branched, &of_branched), expected);
        assert_eq!(columns(&named, &of_chain), columns(&chain, &of_chain));
        assert_eq!(columns(&branched, &of_branched), columns(&chain, &of_chain));
    }
}
